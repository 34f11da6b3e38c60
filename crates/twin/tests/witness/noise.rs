//! Whatever the bytes, the witness comes to a verdict.

use machine::gcode::dialect;
use proptest::prelude::*;
use twin::verify::{Setup, Verifier};

use crate::program::{FILAMENT_AREA, printer, square, tube};

fn judge(lines: &[Vec<u8>]) -> usize {
    let (printer, mesh) = (printer(), tube());
    let mut count = 0;
    for dialect in dialect::ALL {
        let setup = Setup {
            printer: &printer,
            dialect,
            filament_area: FILAMENT_AREA,
            multiplier: 1.0,
            restart_extra: 0.0,
            coarse: 0.0,
            volume_per_second: f64::INFINITY,
            mesh: Some(&mesh),
            solid: true,
            moved: 0.0,
            thorough: false,
        };
        let mut verifier = Verifier::new(setup);
        for line in lines {
            verifier.line_bytes(line);
        }
        let verdict = verifier.finish();
        assert_eq!(verdict.totals.lines, lines.len());
        count += verdict.findings.len();
    }
    count
}

/// Lines that look like a program.
fn program_like() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        "G[0-4](\\.1)?( [A-Z][+-]?[0-9]{0,3}\\.?[0-9]{0,2}){0,5}",
        "G1( [RTXYZEF]-?[0-9]{1,40}(\\.[0-9]{1,3})?){1,5}",
        "[GM](1|4|21|28|90|91|92|82|83|104|109|140|190|117)( [A-Z][0-9]{1,3})?",
        ";(LAYER|Z|HEIGHT|WIDTH|TYPE):-?[0-9]{0,25}(e308|inf|nan)?",
        ";LAYER:18446744073709551615",
        ";TYPE:External perimeter",
    ]
    .prop_map(String::into_bytes)
}

proptest! {
    #[test]
    fn any_bytes(lines in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..60), 0..30)) {
        judge(&lines);
    }

    #[test]
    fn almost_a_program(lines in prop::collection::vec(program_like(), 0..60)) {
        judge(&lines);
    }

    #[test]
    fn a_sound_program_with_a_wrong_byte(at in any::<prop::sample::Index>(), byte in any::<u8>()) {
        let text = square().join("\n");
        let mut bytes = text.into_bytes();
        let index = at.index(bytes.len());
        bytes[index] = byte;
        let lines: Vec<Vec<u8>> = bytes.split(|&b| b == b'\n').map(<[u8]>::to_vec).collect();
        judge(&lines);
    }
}

#[test]
fn numbers_that_overflow_are_found() {
    let huge = "9".repeat(200);
    let lines = [
        "G28".to_string(),
        "G90".into(),
        "M83".into(),
        format!("G1 R{huge} T0 F600"),
        format!("G1 R-{huge} T{huge} Z{huge} E{huge}"),
    ];
    let lines: Vec<Vec<u8>> = lines.into_iter().map(String::into_bytes).collect();
    assert!(judge(&lines) > 10);
}

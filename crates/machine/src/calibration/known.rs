//! What is known of the magnets and the sensor before anything is measured.

use super::log::shown;

/// Settings of a log, each optional. Their names are those of the lines `# name = value`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// `ring_radius_mm`: as it was drawn; believed within 5 %.
    pub ring_radius: Option<f64>,
    /// `ring_radius_sd_mm`: how well the radius is known, where it was measured.
    pub ring_radius_sd: Option<f64>,
    /// `magnets`: places round the ring.
    pub magnets: Option<u32>,
    /// `inner_radius_mm`: of the magnets inside of the ring.
    pub inner_radius: Option<f64>,
    /// `inner_magnets`: places round the inner ring.
    pub inner_magnets: Option<u32>,
    /// `inner_angle_deg`: azimuth on the plate of the first inner magnet, seen from the ring's
    /// index magnet, radians. Without it inner magnets stand anywhere.
    pub inner_angle: Option<f64>,
    /// `plate_angle_deg`: azimuth of the ring's index magnet on the bed, where it was measured,
    /// radians.
    pub plate_angle: Option<f64>,
    /// `plate_angle_sd_deg`: how well, radians.
    pub plate_angle_sd: Option<f64>,
    /// `index_theta_deg`: azimuth at which the index magnet is seen, within half a pitch, radians.
    pub index_theta: Option<f64>,
    /// `bed_reversed`: the bed's count grows counter-clockwise.
    pub bed_is_reversed: bool,
    /// `rail_sd_mm`: how well a magnet is found again along the rail.
    pub rail_sd: f64,
    /// `cross_sd_mm`: the same across.
    pub cross_sd: f64,
    /// `placement_sd_mm`: how well magnets were placed, each way.
    pub placement_sd: f64,
}

impl Default for Known {
    fn default() -> Self {
        Self {
            ring_radius: None,
            ring_radius_sd: None,
            magnets: None,
            inner_radius: None,
            inner_magnets: None,
            inner_angle: None,
            plate_angle: None,
            plate_angle_sd: None,
            index_theta: None,
            bed_is_reversed: false,
            // Assumed for a belt-driven machine and magnets in printed pockets.
            rail_sd: 0.015,
            cross_sd: 0.020,
            placement_sd: 0.050,
        }
    }
}

/// Largest radius that is no mistake, mm.
const GREATEST_RADIUS_MM: f64 = 2000.0;

/// Largest standard deviation that still says something, mm.
const GREATEST_SD_MM: f64 = 10.0;

/// Most places round a ring.
pub(super) const MOST_MAGNETS: u32 = 72;

impl Known {
    /// Returns how far a magnet of the ring is from where it should be, each way, mm.
    #[must_use]
    pub fn ring_sd(&self) -> f64 {
        self.placement_sd.hypot(self.rail_sd.max(self.cross_sd))
    }

    /// Takes over a line `name = value`; all other remarks are let pass.
    pub(super) fn read(&mut self, remark: &str) -> Result<(), Refusal> {
        let Some((key, value)) = remark.split_once('=') else { return Ok(()) };
        let value = value.trim();
        match key.trim() {
            "ring_radius_mm" => self.ring_radius = Some(length("ring_radius_mm", value)?),
            "ring_radius_sd_mm" => self.ring_radius_sd = Some(sd("ring_radius_sd_mm", value)?),
            "magnets" => self.magnets = Some(count("magnets", value, 3)?),
            "inner_radius_mm" => self.inner_radius = Some(length("inner_radius_mm", value)?),
            "inner_magnets" => self.inner_magnets = Some(count("inner_magnets", value, 1)?),
            "inner_angle_deg" => self.inner_angle = Some(angle("inner_angle_deg", value)?),
            "plate_angle_deg" => self.plate_angle = Some(angle("plate_angle_deg", value)?),
            "plate_angle_sd_deg" => {
                self.plate_angle_sd = Some(sd("plate_angle_sd_deg", value)?.to_radians());
            }
            "index_theta_deg" => self.index_theta = Some(angle("index_theta_deg", value)?),
            "rail_sd_mm" => self.rail_sd = sd("rail_sd_mm", value)?,
            "cross_sd_mm" => self.cross_sd = sd("cross_sd_mm", value)?,
            "placement_sd_mm" => self.placement_sd = sd("placement_sd_mm", value)?,
            "bed_reversed" => {
                self.bed_is_reversed = value.parse().map_err(|_| {
                    let what = format!("= {} is neither true nor false", shown(value));
                    ("bed_reversed", what)
                })?;
            }
            _ => {}
        }
        Ok(())
    }
}

/// The name of a setting, and what is wrong with it.
type Refusal = (&'static str, String);

fn within(key: &'static str, value: &str, min: f64, max: f64) -> Result<f64, Refusal> {
    let value: f64 =
        value.parse().map_err(|_| (key, format!("= {} is no number", shown(value))))?;
    let in_range = min <= value && value <= max;
    if in_range { Ok(value) } else { Err((key, format!("= {value:?} is not {min:?} to {max:?}"))) }
}

fn length(key: &'static str, value: &str) -> Result<f64, Refusal> {
    within(key, value, 1.0, GREATEST_RADIUS_MM)
}

/// A standard deviation; below a nanometre the equations would lose their digits.
fn sd(key: &'static str, value: &str) -> Result<f64, Refusal> {
    within(key, value, 1e-6, GREATEST_SD_MM)
}

fn angle(key: &'static str, value: &str) -> Result<f64, Refusal> {
    within(key, value, -1e6, 1e6).map(f64::to_radians)
}

fn count(key: &'static str, value: &str, least: u32) -> Result<u32, Refusal> {
    let value: u32 =
        value.parse().map_err(|_| (key, format!("= {} is no whole number", shown(value))))?;
    let in_range = least <= value && value <= MOST_MAGNETS;
    if in_range {
        Ok(value)
    } else {
        Err((key, format!("= {value} is not {least} to {MOST_MAGNETS}")))
    }
}

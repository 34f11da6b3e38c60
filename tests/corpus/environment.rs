//! The environment: what files, folders, pipes, disks, signals, servers and serial lines do. Each case
//! is a test of its own somewhere; here is the list, and a look that none is missing.

use super::Corpus;
use crate::run::root;

/// Printers on a line that say odd things and do what they are told, and those that do not.
const SERIAL: &str = "crates/rhumb/tests/calibrate_scan.rs::a_printer_on_a_line_is_calibrated";
const SERIAL_FAULT: &str =
    "crates/rhumb/tests/calibrate_scan.rs::whatever_a_printer_does_nothing_wrong_is_written";

/// Cases and the tests that they are, `file::test`. Several cases begin alike.
const HELD_BY: [(&str, &str); 53] = [
    ("missing", "tests/cli.rs::what_cannot_be_read_is_status_3"),
    ("dir_as_file", "tests/cli.rs::what_cannot_be_read_is_status_3"),
    ("symlink_loop", "tests/environment.rs::what_leads_nowhere_is_told"),
    ("unreadable", "tests/environment.rs::permissions_are_kept"),
    ("fifo_input", "tests/outputs.rs::a_pipe_can_be_read_and_a_device_is_written_in_place"),
    ("stdin_input", "tests/environment.rs::a_model_comes_from_standard_input"),
    ("dev_zero", "tests/cli.rs::an_endless_device_is_refused_and_not_read"),
    ("proc_file", "tests/environment.rs::what_leads_nowhere_is_told"),
    ("name_invalid_utf8", "tests/names.rs::no_name_can_give_the_printer_orders"),
    ("name_long_255", "tests/names.rs::no_name_can_give_the_printer_orders"),
    ("name_", "tests/names.rs::a_model_may_be_called_anything"),
    (
        "out_default_name",
        "tests/names.rs::the_default_output_is_named_after_the_model_and_lies_in_the_working_folder",
    ),
    (
        "out_is_in_symlink",
        "tests/cli.rs::links_to_the_input_are_seen_through_and_others_are_followed",
    ),
    ("out_is_in", "tests/outputs.rs::no_output_is_an_input_or_another_output"),
    ("out_dir", "tests/cli.rs::outputs_that_cannot_be_written_are_status_7"),
    ("out_missing_parent", "tests/cli.rs::outputs_that_cannot_be_written_are_status_7"),
    ("out_readonly", "tests/environment.rs::permissions_are_kept"),
    ("out_symlink", "tests/cli.rs::links_to_the_input_are_seen_through_and_others_are_followed"),
    ("out_dangling_symlink", "tests/environment.rs::what_leads_nowhere_is_told"),
    ("out_dev_full", "tests/cli.rs::a_full_disk_and_a_closed_pipe_are_told_apart"),
    ("out_small_tmpfs", "tests/outputs.rs::a_full_disk_leaves_the_old_program_whole"),
    ("out_enospc_on_close", "tests/environment.rs::a_disk_may_be_full_at_any_byte"),
    ("out_rlimit_fsize", "tests/outputs.rs::a_limit_on_the_size_of_files_is_a_full_disk"),
    ("out_dev_null", "tests/outputs.rs::a_pipe_can_be_read_and_a_device_is_written_in_place"),
    ("out_dev_stdout", "tests/environment.rs::a_model_comes_from_standard_input"),
    ("stdout_closed_pipe", "tests/cli.rs::a_full_disk_and_a_closed_pipe_are_told_apart"),
    ("help_closed_pipe", "tests/outputs.rs::help_into_a_closed_pipe_is_no_panic"),
    ("stdout_full", "tests/cli.rs::a_full_disk_and_a_closed_pipe_are_told_apart"),
    ("stderr_", "tests/outputs.rs::closed_and_full_standard_streams_do_not_stop_a_slice"),
    ("stdout_fd_closed", "tests/outputs.rs::closed_and_full_standard_streams_do_not_stop_a_slice"),
    ("sigint_slice", "tests/interrupt.rs::an_interrupted_run_leaves_nothing_behind"),
    ("sigterm_write", "tests/interrupt.rs::a_terminated_run_leaves_nothing_behind"),
    (
        "sigkill_write",
        "tests/outputs.rs::at_whatever_moment_a_run_is_stopped_the_old_program_or_a_whole_one_is_there",
    ),
    ("two_at_once", "tests/outputs.rs::two_runs_for_one_target_leave_one_whole_program"),
    ("deterministic", "tests/environment.rs::place_time_and_language_change_no_byte"),
    (
        "no_home",
        "tests/outputs.rs::few_file_handles_no_environment_and_a_folder_that_is_gone_are_enough",
    ),
    (
        "cwd_deleted",
        "tests/outputs.rs::few_file_handles_no_environment_and_a_folder_that_is_gone_are_enough",
    ),
    (
        "fd_limit",
        "tests/outputs.rs::few_file_handles_no_environment_and_a_folder_that_is_gone_are_enough",
    ),
    ("mem_limit", "tests/budgets.rs::few_addresses_are_enough"),
    ("thread_limit", "tests/environment.rs::one_thread_is_enough"),
    ("clock_1970", "tests/environment.rs::place_time_and_language_change_no_byte"),
    ("net_refused", "tests/send.rs::nobody_there_and_no_print_server_there"),
    ("net_401", "tests/send.rs::a_refused_key_is_told_before_anything_is_sent"),
    ("net_filename", "tests/send.rs::moonraker_gets_the_very_bytes_and_prints_them_when_told"),
    ("net_printing", "tests/send.rs::what_a_server_will_not_take_is_told_in_its_words"),
    ("net_500", "tests/send.rs::what_a_server_will_not_take_is_told_in_its_words"),
    ("net_tls_self_signed", "tests/send.rs::nobody_there_and_no_print_server_there"),
    ("net_", "tests/send_faults.rs::servers_with_faults_end_soon_and_no_key_is_shown"),
    ("serial_resend_loop", SERIAL_FAULT),
    ("serial_resend", SERIAL),
    ("serial_wait_busy", SERIAL),
    ("serial_temp_autoreport", SERIAL),
    ("serial_", SERIAL_FAULT),
];

#[test]
fn every_case_of_the_environment_is_a_test() {
    let Some(corpus) = Corpus::get() else { return };
    let mut n_cases = 0;
    for case in corpus.cases(&["io"]) {
        let name = case["id"].as_str().unwrap().strip_prefix("io/").unwrap();
        let (_, held_by) = HELD_BY.iter().find(|(begin, _)| name.starts_with(begin)).unwrap();
        let (file, test) = held_by.split_once("::").unwrap_or_else(|| panic!("{name} is no test"));
        let text = std::fs::read_to_string(root().join(file)).unwrap();
        assert!(text.contains(&format!("\nfn {test}()")), "{name}: {file} has no test {test}");
        n_cases += 1;
    }
    assert_eq!(n_cases, 78);
}

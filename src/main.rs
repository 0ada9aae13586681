//! The command line of Calamus: see [`calamus::cli`].
use std::process::ExitCode;

/// Mesa's device-select layer asks a display that headless machines lack, and complains on standard error; Calamus takes the adapter
/// that it likes best by itself.
const DEVICE_SELECT: &str = "NODEVICE_SELECT";

fn main() -> ExitCode {
    if std::env::var_os(DEVICE_SELECT).is_none() {
        // SAFETY: no other thread runs yet that could read the environment meanwhile
        #[allow(unsafe_code)]
        unsafe {
            std::env::set_var(DEVICE_SELECT, "1");
        }
    }
    calamus::cli::main()
}

//! How long an adapter's driver holds back short replies, if it reports that.

use std::fs;
use std::path::{Path, PathBuf};

use super::device::Device;

/// Path at which the system describes its serial devices.
const DEVICES: &str = "/sys/class/tty";

/// Advice when the driver holds replies back for longer than the robot file says. By default FTDI's driver does so
/// for 16 ms, too long for a loop of more than some 50 Hz.
pub(super) fn advice(device: &Device) -> Option<String> {
    advice_from(Path::new(DEVICES), device)
}

fn advice_from(devices: &Path, device: &Device) -> Option<String> {
    let (setting, timer_ms) = latency_timer(devices, &device.path)?;
    if timer_ms * 1000 <= u64::from(device.adapter_latency_us) {
        return None;
    }
    let setting = setting.display();
    Some(format!(
        "bus {}: its adapter holds short replies back for up to {timer_ms} ms, but adapter_latency_us is {}: set it \
         to 1 ms ('echo 1 | sudo tee {setting}', permanently with a udev rule), or set adapter_latency_us to {}",
        device.bus,
        device.adapter_latency_us,
        timer_ms * 1000
    ))
}

/// File and value of the setting, ms; `None` if the driver has none.
fn latency_timer(devices: &Path, path: &Path) -> Option<(PathBuf, u64)> {
    let device = path.canonicalize().ok()?;
    let setting = devices.join(device.file_name()?).join("device/latency_timer");
    let timer_ms = fs::read_to_string(&setting).ok()?.trim().parse().ok()?;
    Some((setting, timer_ms))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The advice for /dev/null, described as an adapter with this `timer`.
    fn advice_for(timer: &str) -> Option<String> {
        let folder = tempfile::tempdir().unwrap();
        let described = folder.path().join("null/device");
        fs::create_dir_all(&described).unwrap();
        fs::write(described.join("latency_timer"), timer).unwrap();
        let device = Device {
            bus: "legs".into(),
            path: "/dev/null".into(),
            baud: 1_000_000,
            adapter_latency_us: 1000,
        };
        advice_from(folder.path(), &device)
    }

    #[test]
    fn a_latency_above_that_of_the_robot_file_gets_a_remark() {
        let advice = advice_for("16\n").unwrap();
        assert!(advice.contains("up to 16 ms") && advice.contains("null/device/latency_timer"), "{advice}");
        assert!(advice.ends_with("set adapter_latency_us to 16000"), "{advice}");
    }

    #[test]
    fn a_latency_that_fits_or_is_unknown_gets_no_remark() {
        assert_eq!(advice_for("1\n"), None);
        assert_eq!(advice_for("unknown"), None);
    }
}

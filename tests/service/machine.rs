//! A small machine of its own, in namespaces, with systemd as its first process: for a service as it is shipped.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use hippocamp::platform::{monotonic, sleep_until};

/// Nothing here takes longer, even on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);
const SYSTEMD: &str = "/lib/systemd/systemd";

/// A running machine. It ends, with all that runs in it, when dropped.
pub(crate) struct Machine {
    /// `unshare`, whose one child is the machine's first process.
    shell: Child,
    /// That child, as this process sees it.
    first: u32,
    /// The machine's control group.
    group: PathBuf,
    pub(crate) log: PathBuf,
}

impl Machine {
    /// Why there can be no such machine here; none where there can be.
    pub(crate) fn obstacle() -> Option<String> {
        if !rustix::process::geteuid().is_root() {
            return Some("it needs root, to make namespaces and control groups".to_owned());
        }
        if !Path::new(SYSTEMD).exists() {
            return Some(format!("there is no systemd here ({SYSTEMD})"));
        }
        let Some(parent) = parent_group() else {
            return Some("there are no control groups of version 2 here".to_owned());
        };
        let group = parent.join(format!("hippocamp-probe-{}", std::process::id()));
        if let Err(error) = fs::create_dir(&group) {
            return Some(format!("no control group can be made here: {}: {error}", group.display()));
        }
        let _ = fs::remove_dir(&group);
        let script = "mount -t tmpfs tmpfs /mnt && mkdir /mnt/u /mnt/w /mnt/r && \
                      mount -t overlay overlay -o lowerdir=/,upperdir=/mnt/u,workdir=/mnt/w /mnt/r";
        let probe = Command::new("unshare")
            .args(["--mount", "--pid", "--cgroup", "--ipc", "--uts", "--fork", "sh", "-c", script])
            .output();
        match probe {
            Ok(output) if output.status.success() => None,
            Ok(output) => Some(format!(
                "no namespaces with a layer over the files: {}",
                String::from_utf8_lossy(&output.stderr).trim()
            )),
            Err(error) => Some(format!("unshare: {error}")),
        }
    }

    /// Boots one with the program, the service of `unit`, the files in `robot`, and its serial `devices`; `folder` is for
    /// what the machine itself needs.
    pub(crate) fn boot(folder: &Path, unit: &Path, robot: &Path, devices: &[PathBuf]) -> Machine {
        let group = parent_group().unwrap().join(format!(
            "hippocamp-test-{}-{}",
            std::process::id(),
            folder.file_name().unwrap().display()
        ));
        fs::create_dir(&group).unwrap();
        let layer = folder.join("layer");
        fs::create_dir(&layer).unwrap();
        let log = folder.join("log");
        let into_group = r#"echo 0 > "$1/cgroup.procs"; shift; exec unshare --mount --pid --cgroup --ipc --uts --fork \
                            --kill-child sh "$@""#;
        let shell = Command::new("sh")
            .args(["-c", into_group, "sh"])
            .arg(&group)
            .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/service/boot.sh"))
            .args([&layer, Path::new(env!("CARGO_BIN_EXE_hippocamp")), unit, robot])
            .args(devices)
            .stdin(Stdio::null())
            .stdout(fs::File::create(&log).unwrap())
            .stderr(fs::File::options().append(true).open(&log).unwrap())
            .spawn()
            .unwrap();
        let mut machine = Machine { shell, first: 0, group, log };
        let shell = machine.shell.id();
        machine.wait_for("first process", |machine| {
            let children = format!("/proc/{shell}/task/{shell}/children");
            machine.first =
                fs::read_to_string(children).ok().and_then(|text| text.trim().parse().ok()).unwrap_or(0);
            machine.first != 0
        });
        machine.wait_for("systemd", |machine| {
            machine.systemctl(&["is-active", "boot.target"]).is_ok_and(|output| output.status.success())
        });
        machine
    }

    /// A command in the machine.
    pub(crate) fn run(&self, command: &[&str]) -> std::io::Result<Output> {
        let first = self.first.to_string();
        Command::new("nsenter").args(["--target", &first, "--all"]).args(command).output()
    }

    /// `systemctl` in the machine.
    pub(crate) fn systemctl(&self, arguments: &[&str]) -> std::io::Result<Output> {
        self.run(&[&["systemctl"], arguments].concat())
    }

    /// The value of a `property` of `unit` from `systemctl`.
    pub(crate) fn property(&self, unit: &str, property: &str) -> String {
        let output = self.systemctl(&["show", "--value", "--property", property, unit]).unwrap();
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    }

    /// The control group of an instance of a service.
    fn group_of(&self, template: &str, instance: &str) -> PathBuf {
        self.group.join(format!("system.slice/system-{template}.slice/{template}@{instance}.service"))
    }

    /// The processes of an instance of a service.
    pub(crate) fn processes(&self, template: &str, instance: &str) -> Vec<u32> {
        let text = fs::read_to_string(self.group_of(template, instance).join("cgroup.procs"));
        text.unwrap_or_default().lines().map(|line| line.parse().unwrap()).collect()
    }

    /// Has a process of an instance of a service do nothing until the group that is returned is thawed. It can be killed.
    pub(crate) fn freeze(&self, template: &str, instance: &str, process: u32) -> PathBuf {
        let group = self.group_of(template, instance).join("frozen");
        fs::create_dir(&group).unwrap();
        fs::write(group.join("cgroup.procs"), process.to_string()).unwrap();
        fs::write(group.join("cgroup.freeze"), "1").unwrap();
        while !fs::read_to_string(group.join("cgroup.events")).unwrap().contains("frozen 1") {
            std::thread::yield_now();
        }
        group
    }

    /// Waits until `is_so`.
    pub(crate) fn wait_for(&mut self, what: &str, mut is_so: impl FnMut(&mut Machine) -> bool) {
        let start = monotonic();
        while !is_so(self) {
            let is_too_late = monotonic() - start > PATIENCE || self.shell.try_wait().unwrap().is_some();
            assert!(!is_too_late, "no {what}: {}", fs::read_to_string(&self.log).unwrap_or_default());
            sleep_until(monotonic() + Duration::from_millis(2));
        }
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        // Its first process dies with its parent, and with that one all others of its namespace.
        let _ = self.shell.kill();
        let _ = self.shell.wait();
        let start = monotonic();
        while !remove(&self.group) && monotonic() - start < PATIENCE {
            sleep_until(monotonic() + Duration::from_millis(2));
        }
    }
}

/// Ends what [`Machine::freeze`] did.
pub(crate) fn thaw(group: &Path) {
    fs::write(group.join("cgroup.freeze"), "0").unwrap();
}

/// Removes a control group and all inside it; false while a process is in one of them.
fn remove(group: &Path) -> bool {
    let inside = fs::read_dir(group).into_iter().flatten().flatten().map(|entry| entry.path());
    for path in inside.filter(|path| path.is_dir()) {
        remove(&path);
    }
    fs::remove_dir(group).is_ok()
}

/// The control group of version 2 this process is in, where such are mounted.
fn parent_group() -> Option<PathBuf> {
    let mounts = fs::read_to_string("/proc/self/mounts").ok()?;
    let place = mounts.lines().map(|line| line.split(' ').collect::<Vec<_>>());
    let place = place.into_iter().find(|words| words.get(2) == Some(&"cgroup2"))?[1].to_owned();
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let own = groups.lines().find_map(|line| line.strip_prefix("0::"))?;
    Some(Path::new(&place).join(own.trim_start_matches('/')))
}

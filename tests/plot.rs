//! The data of the pictures of `plot`, and that they are drawn.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::path::Path;
use std::process::Command;

use hippocamp::config;
use hippocamp::kinds::horse::Horse;
use hippocamp::model::Robot;
use hippocamp::motion::horse::thesis_rule::{SteadyGait, ThesisRule};
use hippocamp::motion::{self, GaitChoice, Generator, Order};
use hippocamp::plot::{self, Course, CourseError, Subject};

/// A robot with its capability.
struct Rig {
    robot: Robot,
    kind: Horse,
}

impl Rig {
    fn load(file: &str) -> Rig {
        let robot = config::load(Path::new(file)).unwrap().robot;
        let kind = Horse::of(&robot, robot.motion.horse().unwrap()).unwrap();
        Rig { robot, kind }
    }

    fn subject(&self) -> Subject<'_> {
        Subject::of(&self.robot, &self.kind)
    }

    fn gait(&self, name: &str) -> usize {
        self.kind.settings.gaits.iter().position(|gait| gait.name == name).unwrap()
    }

    /// Walks in one gait until `change_s`, then in another until `end_s`.
    fn course(&self, first: (&str, f64), then: (&str, f64), change_s: f64, end_s: f64) -> Course<'_> {
        let order = |(gait, speed_m_s): (&str, f64)| {
            let gait = GaitChoice::Gait(self.gait(gait));
            Order::Drive(motion::Command { gait, speed_m_s, ..motion::Command::default() })
        };
        let plan = self.kind.capability.plan(&self.kind.settings, motion::Command::default());
        let generator = Generator::new(&self.robot, plan, f64::MAX);
        let (first, then) = (order(first), order(then));
        let orders = |s: f64| if s < change_s { first } else { then };
        Course::follow(self.subject(), generator, (0.0, end_s), orders).unwrap()
    }

    fn steady(&self, gait: &str, speed_m_s: f64, end_s: f64) -> Course<'_> {
        self.course((gait, speed_m_s), (gait, speed_m_s), f64::INFINITY, end_s)
    }
}

#[test]
fn bars_match_the_duty_factor_and_phase_offsets_of_the_gait() {
    for (file, share) in [("config/thoroughbred.toml", 0.8), ("config/horse.toml", 0.8)] {
        let rig = Rig::load(file);
        for (index, gait) in rig.kind.settings.gaits.iter().enumerate() {
            let plan = rig.kind.capability.plan(&rig.kind.settings, motion::Command::default());
            let speed_m_s = share * plan.top_speed_m_s(GaitChoice::Gait(index));
            if speed_m_s <= 0.0 {
                continue;
            }
            let period_s = gait.period_s(rig.kind.settings.swing_time_s);
            let course = rig.steady(&gait.name, speed_m_s, 15.0 * period_s);
            let stances = course.stances();
            // A bar ends when its foot lifts. Strides 4 to 12 are long after the start.
            let lift_s = |foot: usize, stride: usize| stances[foot][stride].1;
            // Lift-offs and landings are seen within a cycle.
            let tolerance = 1.01 / (period_s * rig.robot.rate_hz);
            for (foot, bars) in stances.iter().enumerate() {
                let on_ground_s: f64 = bars[5..=12].iter().map(|(from_s, to_s)| to_s - from_s).sum();
                let share = on_ground_s / (lift_s(foot, 12) - lift_s(foot, 4));
                let name = format!("{file}: {} foot {foot}", gait.name);
                assert!((share - gait.duty_factor).abs() <= tolerance, "{name}: {share}");
                let after = (lift_s(foot, 8) - lift_s(0, 8)) / period_s;
                let phase_offset = (after - gait.phase_offsets[foot] + 0.5).rem_euclid(1.0) - 0.5;
                assert!(phase_offset.abs() <= tolerance, "{name}: lifts {phase_offset} of a period off");
            }
        }
    }
}

#[test]
fn walk_to_trot_keeps_in_reach_where_the_thesis_rule_does_not() {
    let rig = Rig::load("config/thoroughbred.toml");
    let course = rig.course(("walk", 1.78), ("trot", 3.9), 4.0, 9.0);
    let reach_m = rig.kind.capability.half_excursion_m();
    let change = course.first_change().unwrap();
    assert_eq!(change.gaits, [rig.gait("walk"), rig.gait("trot")]);
    assert!((change.ordered_s - 4.0).abs() < 1e-9, "{change:?}");
    assert!((change.speeds_m_s[0] - 1.78).abs() < 1e-9 && (change.speeds_m_s[1] - 3.9).abs() < 1e-9);

    let feet = || course.frames.iter().flat_map(|frame| &frame.feet);
    let furthest_m = feet().map(|foot| foot.excursion_m.abs()).fold(0.0, f64::max);
    assert!(furthest_m <= reach_m, "{furthest_m} m of {reach_m} m");

    let steady = |side: usize| SteadyGait {
        gait: &rig.kind.settings.gaits[change.gaits[side]],
        speed_m_s: change.speeds_m_s[side],
    };
    let swing = rig.kind.capability.plan(&rig.kind.settings, motion::Command::default()).swing();
    let rule = ThesisRule::new(swing, steady(0), steady(1), 0.0);
    let beyond = (0..4).filter(|leg| rule.lift_off_m(*leg).abs() > reach_m).count();
    assert_eq!(beyond, 3, "all but the left hind");
}

#[test]
fn feet_of_the_stick_figure_match_the_plan() {
    // The pictures show joint angles after safety, which changes none on this robot.
    let rig = Rig::load("config/thoroughbred.toml");
    let course = rig.course(("walk", 1.78), ("trot", 3.9), 3.0, 6.0);
    assert!(course.frames.iter().all(|frame| frame.interventions == 0));
    for frame in &course.frames {
        for foot in &frame.feet {
            let chain = &rig.robot.chains[foot.chain];
            let angles = frame.goal_rad[chain.joints.clone()].iter().copied();
            let tip = frame.trunk_in_world + frame.trunk_orientation * rig.robot.tip_in_body(chain, angles);
            let miss_m = tip.distance(foot.in_world);
            assert!(miss_m < 2e-4, "{}: {miss_m} m off at {} s", chain.name, frame.time_s);
        }
    }
}

/// Every element is closed, in its own order, and the picture is as wide as it should be.
fn check_svg(svg: &str) {
    assert!(svg.starts_with("<svg width=\"800\""), "{}", &svg[..80]);
    let mut open: Vec<&str> = Vec::new();
    for part in svg.split('<').skip(1) {
        let (tag, text) = part.split_once('>').expect("a tag ends");
        assert!(!text.contains('>') && tag.matches('"').count() % 2 == 0, "{part}");
        let name = tag.trim_start_matches('/').split(|c: char| c.is_whitespace() || c == '/').next().unwrap();
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(name);
        }
        assert!(!tag.contains("NaN") && !tag.contains("inf"), "{tag}");
    }
    assert!(open.is_empty(), "{open:?}");
    assert!(svg.trim_end().ends_with("</svg>"));
}

#[test]
fn pictures_are_complete_and_always_the_same() {
    let rig = Rig::load("config/horse.toml");
    let draw = || {
        let course = rig.course(("walk", 0.03), ("trot", 0.05), 5.0, 12.0);
        let change = course.first_change().unwrap();
        let steady = |side: usize| SteadyGait {
            gait: &rig.kind.settings.gaits[change.gaits[side]],
            speed_m_s: change.speeds_m_s[side],
        };
        let swing = rig.kind.capability.plan(&rig.kind.settings, motion::Command::default()).swing();
        let rule = ThesisRule::new(swing, steady(0), steady(1), 0.0);
        [
            plot::feet(&course),
            plot::footfalls(&course),
            plot::joints(&course),
            plot::poses(&course),
            plot::comparison(&course, &change, &rule, swing.time_s),
        ]
        .map(Result::unwrap)
    };
    let pictures = draw();
    pictures.iter().for_each(|svg| check_svg(svg));
    assert_eq!(pictures, draw());
    for name in ["left hind", "left fore", "right hind", "right fore"] {
        assert!(pictures[0].contains(name) && pictures[1].contains(name), "{name}");
    }
    // A dot for each foot of twelve poses.
    assert_eq!(pictures[3].matches("<circle").count(), 4 * 12);
}

#[test]
fn a_span_after_the_end_shows_nothing() {
    let rig = Rig::load("config/thoroughbred.toml");
    let plan = rig.kind.capability.plan(&rig.kind.settings, motion::Command::default());
    let generator = Generator::new(&rig.robot, plan, f64::MAX);
    let orders = |s: f64| if s < 1.0 { Order::Drive(motion::Command::default()) } else { Order::Stop };
    let error = Course::follow(rig.subject(), generator, (2.0, 9.0), orders).unwrap_err();
    assert!(
        matches!(error, CourseError::NothingToShow { ended_s } if (ended_s - 1.0).abs() < 1e-9),
        "{error}"
    );
}

/// Runs `hippocamp plot` on the thoroughbred; its exit code and output.
fn plot_command(script: &Path, out: &Path, rest: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hippocamp"));
    command.args(["plot", "config/thoroughbred.toml", "--script"]).arg(script).arg("--out").arg(out);
    let output = command.args(rest).output().unwrap();
    let said = [output.stdout, output.stderr].concat();
    (output.status.code(), String::from_utf8(said).unwrap())
}

#[test]
fn the_command_draws_a_robot_on_paper() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new/pictures");
    let (code, said) = plot_command(Path::new("docs/walk-to-trot.toml"), &out, &["--thesis"]);
    assert_eq!(code, Some(0), "{said}");
    for name in ["feet", "footfalls", "joints", "poses", "thesis"] {
        let svg = std::fs::read_to_string(out.join(format!("{name}.svg"))).unwrap();
        check_svg(&svg);
    }
    assert!(said.contains("safety changed 0 of"), "{said}");
}

#[test]
fn impossible_pictures_are_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let (out, steady) = (folder.path().join("pictures"), folder.path().join("steady.toml"));
    std::fs::write(&steady, "[[at]]\ntime_s = 0\ngait = \"walk\"\nspeed_m_s = 1\n").unwrap();
    let cases: [(&Path, &[&str], &str); 6] = [
        (&steady, &["--thesis"], "expected a change from one gait to another"),
        (&steady, &["--from", "3", "--to", "2"], "expected a part of the script, which lasts 5 s"),
        (&steady, &["--from", "7"], "expected a part of the script"),
        (&steady, &["--from", "nan"], "expected a part of the script"),
        (&steady, &["--to", "nan"], "expected a part of the script"),
        (Path::new("nowhere.toml"), &[], "nowhere.toml"),
    ];
    for (script, rest, expected) in cases {
        let (code, said) = plot_command(script, &out, rest);
        assert_eq!(code, Some(2), "{rest:?}: {said}");
        assert!(said.contains(expected), "{rest:?}: {said}");
        assert!(!out.exists(), "{rest:?}");
    }
}

use super::*;

/// Runs a cycle with this deadline, ms, whose stages take these times, ms, and whose thread has this usage.
fn cycle(watch: &mut Stopwatch, deadline_ms: u64, took_ms: &[(Stage, u64)], usage: Usage) {
    let at = |ms: u64| Time(1_000_000 * ms);
    let mut now_ms = deadline_ms;
    for stage in Stage::ALL {
        now_ms += took_ms.iter().filter(|(of, _)| *of == stage).map(|(_, ms)| ms).sum::<u64>();
        match stage {
            Stage::Wake => watch.begin(at(deadline_ms), at(now_ms), Duration::from_millis(2)),
            stage => watch.note(stage, at(now_ms)),
        }
    }
    watch.end(usage);
}

fn usage(processor_ms: u64, waited_ms: u64, page_faults: u64) -> Usage {
    let [processor, waited] = [processor_ms, waited_ms].map(Duration::from_millis);
    Usage { processor, waited: Some(waited), page_faults, disk_faults: 1 }
}

#[test]
fn the_slowest_cycle_is_kept_stage_by_stage_and_the_first_cycle_apart() {
    let mut watch = Stopwatch::new();
    cycle(&mut watch, 500, &[(Stage::Orders, 900)], usage(5, 2, 70));
    let rest = (Stage::Exchange, 5);
    cycle(&mut watch, 1500, &[rest, (Stage::Wake, 1)], usage(6, 2, 70));
    cycle(&mut watch, 1510, &[rest, (Stage::Wake, 2), (Stage::Kinematics, 720)], usage(8, 721, 74));
    cycle(&mut watch, 2240, &[rest, (Stage::Safety, 1)], usage(9, 721, 74));
    let report = watch.report();
    let slowest = report.slowest.unwrap();
    assert_eq!((slowest.number, slowest.total_us), (2, 727_000));
    assert!((slowest.time_s - 1.01).abs() < 1e-9, "{slowest:?}");
    assert_eq!(slowest.longest(), (Stage::Kinematics, 720_000));
    let all = slowest.stages_us.iter().filter(|(_, us)| **us > 0).map(|(stage, us)| (stage.name(), *us));
    assert_eq!(all.collect::<Vec<_>>(), [("wake", 2000), ("kinematics", 720_000), ("exchange", 5000)]);
    assert_eq!((slowest.processor_us, slowest.waited_us), (2000, Some(719_000)));
    assert_eq!((slowest.page_faults, slowest.disk_faults), (4, 0));
    assert_eq!(
        slowest.to_string(),
        "slowest cycle: number 2 at 1.0 s took 727000 us, 720000 of them kinematics; others had the processor for \
         719000 us of it, the loop for 2000 us, with 4 page faults"
    );
    assert_eq!(report.first.unwrap().longest(), (Stage::Orders, 900_000));
    let quantiles = report.stages_us.unwrap();
    assert_eq!(quantiles.of(Stage::Yielding).max, 0);
    // Two digits.
    let max_us = quantiles.of(Stage::Kinematics).max;
    assert!((716_000..=728_000).contains(&max_us), "{max_us}");
}

#[test]
fn the_exchange_is_the_longest_stage_only_if_it_exceeds_all_others_together() {
    let mut watch = Stopwatch::new();
    for (sag_ms, expected) in [(4, Stage::Exchange), (6, Stage::Sag)] {
        cycle(&mut watch, 0, &[(Stage::Exchange, 5), (Stage::Sag, sag_ms)], Usage::default());
        cycle(&mut watch, 20, &[(Stage::Exchange, 5), (Stage::Sag, sag_ms)], Usage::default());
        assert_eq!(watch.report().slowest.unwrap().longest().0, expected);
    }
}

#[test]
fn a_report_names_each_stage_once() {
    let json = serde_json::to_value(Stages::<u64>::default()).unwrap();
    assert_eq!(json.as_object().unwrap().len(), Stage::ALL.len());
    assert_eq!(json["recording"], 0);
}

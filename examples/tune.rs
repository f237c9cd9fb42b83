use hippocamp::{config, model::ReflexMode, trial::Trials};
use std::sync::Mutex;
fn main() {
    let mut args = std::env::args().skip(1);
    let sides: Vec<f64> = args.next().unwrap().split(',').map(|x| x.parse().unwrap()).collect();
    let mode = args.next().unwrap();
    for path in args {
        let robot = config::load(std::path::Path::new(&path)).unwrap().robot;
        let trials = Trials::new(&robot).unwrap();
        let scenes: Vec<_> = (0..72)
            .map(|n| trials.scene(11, n))
            .filter(|s| {
                let deg = s.towards_rad.to_degrees();
                s.impulse_ns > 0.4 && sides.iter().any(|side| (side - deg).abs() < 1.0)
            })
            .collect();
        let next = Mutex::new(0usize);
        let out = Mutex::new(vec![]);
        std::thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| {
                    loop {
                        let i = {
                            let mut n = next.lock().unwrap();
                            let i = *n;
                            *n += 1;
                            i
                        };
                        if i >= scenes.len() {
                            break;
                        }
                        let mode = if mode == "passive" { ReflexMode::Passive } else { ReflexMode::Reflex };
                        let o = trials.observe(&scenes[i], mode, false).unwrap();
                        out.lock().unwrap().push((
                            i,
                            scenes[i].towards_rad.to_degrees().round(),
                            o.impact_n.round(),
                            o.head_impact_n.round(),
                            (o.joint_load_nm * 100.0).round() / 100.0,
                        ));
                    }
                });
            }
        });
        let mut out = out.into_inner().unwrap();
        out.sort_by_key(|x| x.0);
        print!("{path}: ");
        for o in &out {
            print!("{}:{}/{}/{} ", o.1, o.2, o.3, o.4);
        }
        println!();
    }
}

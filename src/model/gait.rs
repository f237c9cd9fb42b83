//! The gait as data: periods, stride lengths, lift-off order (Takizawa 2005, 2.2, 3.1, 3.3, chapter 4).

use super::Gait;

impl Gait {
    /// The gaits a horse knows by itself: from Takizawa 2005, the table of 2.2 with the lags of 3.3;
    /// `walk-steady` is ours: its longer stance keeps a robot inside the triangle of its standing feet.
    pub fn built_in() -> Vec<Gait> {
        [
            ("walk", 0.70, 0.20, 0.50),
            ("walk-steady", 0.75, 0.25, 0.50),
            ("trot", 0.50, 0.50, 0.50),
            ("canter", 0.30, 0.20, 0.20),
            ("gallop", 0.25, 0.35, 0.20),
        ]
        .map(|(name, duty_factor, fore_hind_lag, left_right_lag)| Gait {
            name: name.to_owned(),
            duty_factor,
            lags: Gait::lags_of_thesis(fore_hind_lag, left_right_lag),
        })
        .into()
    }

    /// Lift-off of each leg as shares of the period, from the thesis' two lags: D1 of the fore foot after the hind
    /// foot of its side, D2 of the right feet after the left ones. LH 0, LF D1, RH D2, RF D1 + D2, modulo 1.
    pub fn lags_of_thesis(fore_hind_lag: f64, left_right_lag: f64) -> [f64; 4] {
        let both = (fore_hind_lag + left_right_lag) % 1.0;
        // Lags that add up to the period but for rounding mean its start.
        let both = if 1.0 - both < 1e-9 { 0.0 } else { both };
        [0.0, fore_hind_lag, left_right_lag, both]
    }

    /// Period T = P / (1 - alpha), s, for the swing time P (thesis 3.2).
    pub fn period_s(&self, swing_time_s: f64) -> f64 {
        swing_time_s / (1.0 - self.duty_factor)
    }

    /// Stride S = V P / (1 - alpha), m (thesis 3.3).
    pub fn stride_m(&self, speed_m_s: f64, swing_time_s: f64) -> f64 {
        speed_m_s * self.period_s(swing_time_s)
    }

    /// True if `leg` is in the air at the clock's `phase` (periods since the left hind's lift-off).
    pub fn is_swing(&self, leg: usize, phase: f64) -> bool {
        (phase - self.lags[leg]).rem_euclid(1.0) < 1.0 - self.duty_factor
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn thesis() -> [Gait; 4] {
        let all = Gait::built_in();
        ["walk", "trot", "canter", "gallop"]
            .map(|name| all.iter().find(|gait| gait.name == name).unwrap().clone())
    }

    #[test]
    fn period_and_stride_at_the_thesis_check_values() {
        // V 15 m/s, P 0.3 s, alpha 0.25 give T 0.4 s, S 6 m; the foot's mean swing speed is S / P = 20 m/s.
        let gallop = &thesis()[3];
        assert!((gallop.period_s(0.3) - 0.4).abs() < 1e-12);
        assert!((gallop.stride_m(15.0, 0.3) - 6.0).abs() < 1e-12);
    }

    /// Beats of a gait: legs that lift together, in order, from the left hind on.
    fn beats(gait: &Gait) -> Vec<Vec<usize>> {
        let mut order: Vec<usize> = (0..4).collect();
        order.sort_by(|&a, &b| gait.lags[a].total_cmp(&gait.lags[b]));
        let mut beats: Vec<Vec<usize>> = Vec::new();
        for leg in order {
            match beats.last_mut() {
                Some(beat) if (gait.lags[beat[0]] - gait.lags[leg]).abs() < 1e-9 => beat.push(leg),
                _ => beats.push(vec![leg]),
            }
        }
        beats
    }

    #[test]
    fn footfalls_come_in_the_order_and_beats_of_horses() {
        let (lh, lf, rh, rf) = (0, 1, 2, 3);
        let [walk, trot, canter, gallop] = thesis();
        assert_eq!(beats(&walk), [vec![lh], vec![lf], vec![rh], vec![rf]]);
        assert_eq!(beats(&trot), [vec![lh, rf], vec![lf, rh]]);
        assert_eq!(beats(&canter), [vec![lh], vec![lf, rh], vec![rf]]);
        assert_eq!(beats(&gallop), [vec![lh], vec![rh], vec![lf], vec![rf]]);
    }

    #[test]
    fn feet_in_the_air_as_the_thesis_says() {
        let in_air = |gait: &Gait, phase: f64| (0..4).filter(|&leg| gait.is_swing(leg, phase)).count();
        let phases = || (0..1000).map(|step| (f64::from(step) + 0.5) / 1000.0);
        let [walk, trot, canter, gallop] = thesis();
        assert!(phases().all(|phase| in_air(&walk, phase) >= 1));
        assert!(phases().all(|phase| in_air(&trot, phase) == 2));
        for (gait, flight) in [(canter, 0.3), (gallop, 0.2)] {
            let all = phases().filter(|&phase| in_air(&gait, phase) == 4).count();
            assert!((all as f64 / 1000.0 - flight).abs() < 0.002, "{}: {all} of 1000", gait.name);
        }
    }
}

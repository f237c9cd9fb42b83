//! A glide from any position and motion to rest at another position: the quintic that begins with the same
//! position, speed and acceleration and ends at rest, so that nothing jumps when the goal changes on the way.
//! From rest it is the smooth step.

/// The glide of one number.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct QuinticMove {
    /// Coefficients for the time since it began, from the constant upwards.
    coefficients: [f64; 6],
    /// Its end position, and its duration, s.
    end: f64,
    duration_s: f64,
}

impl QuinticMove {
    /// At rest at `place`.
    pub(super) fn at(place: f64) -> QuinticMove {
        QuinticMove { coefficients: [place, 0.0, 0.0, 0.0, 0.0, 0.0], end: place, duration_s: 0.0 }
    }

    /// Glides from the position `time_s` after its beginning to `end` in `duration_s`, above 0; its time restarts.
    pub(super) fn turn_to(&mut self, time_s: f64, end: f64, duration_s: f64) {
        let [p, v, a] = self.motion(time_s);
        let t = duration_s;
        // Difference at the end from the parabola it is on, in position, speed and acceleration.
        let (dp, dv, da) = (end - (p + v * t + 0.5 * a * t * t), -(v + a * t), -a);
        self.coefficients = [
            p,
            v,
            0.5 * a,
            (10.0 * dp - 4.0 * dv * t + 0.5 * da * t * t) / t.powi(3),
            (-15.0 * dp + 7.0 * dv * t - da * t * t) / t.powi(4),
            (6.0 * dp - 3.0 * dv * t + 0.5 * da * t * t) / t.powi(5),
        ];
        (self.end, self.duration_s) = (end, duration_s);
    }

    /// Position at `time_s`.
    pub(super) fn place(&self, time_s: f64) -> f64 {
        self.motion(time_s)[0]
    }

    /// Position, speed and acceleration.
    fn motion(&self, time_s: f64) -> [f64; 3] {
        if time_s >= self.duration_s {
            return [self.end, 0.0, 0.0];
        }
        let [c0, c1, c2, c3, c4, c5] = self.coefficients;
        let t = time_s;
        [
            c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))),
            c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5))),
            2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5)),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::curves::smooth_step;

    #[test]
    fn a_glide_from_rest_is_a_smooth_step() {
        let mut glide = QuinticMove::at(2.0);
        glide.turn_to(0.0, 5.0, 1.5);
        for step in 0..=150 {
            let time_s = f64::from(step) * 0.01;
            assert!((glide.place(time_s) - (2.0 + 3.0 * smooth_step(time_s / 1.5))).abs() < 1e-12);
        }
        assert_eq!(glide.place(9.0).to_bits(), 5.0_f64.to_bits());
    }

    #[test]
    fn a_new_goal_on_the_way_causes_no_jump_of_position_speed_or_acceleration() {
        let mut glide = QuinticMove::at(0.0);
        glide.turn_to(0.0, 1.0, 1.0);
        for (time_s, end, duration_s) in [(0.3, -2.0, 0.8), (0.25, 4.0, 2.0), (1.1, 0.5, 0.6)] {
            let before = glide.motion(time_s);
            glide.turn_to(time_s, end, duration_s);
            for (before, after) in before.iter().zip(glide.motion(0.0)) {
                assert!((before - after).abs() < 1e-9, "{before} became {after}");
            }
            let end_of_curve = glide.motion(duration_s * (1.0 - 1e-9));
            assert!((end_of_curve[0] - end).abs() < 1e-6 && end_of_curve[1].abs() < 1e-6);
            assert!(end_of_curve[2].abs() < 1e-5);
        }
    }
}

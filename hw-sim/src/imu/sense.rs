//! How the unit measures the truth: late, rotated by its mounting, and with errors.

use std::collections::VecDeque;

use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use super::config::ImuConfig;
use crate::body::BodyState;
use crate::convert::nanoseconds;

/// Time constant of the slow part of an angle's error, s. Our choice; the maker states none.
const DRIFT_S: f64 = 20.0;
/// How fast hands turn a trunk, rad/s.
const HANDS_RAD_S: f64 = 0.8;
/// Gravity, m/s^2, if there is no body: the same as in the rigid body.
const GRAVITY: f64 = 9.81;

type Vector = [f64; 3];

/// The truth of one motor step, in the trunk's axes.
#[derive(Debug, Clone, Copy)]
struct Truth {
    at_ns: u64,
    rotation: [f64; 4],
    rate_rad_s: Vector,
    force_m_s2: Vector,
}

/// The content of one output, in the unit's axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Measurement {
    pub(super) force_m_s2: Vector,
    pub(super) rate_rad_s: Vector,
    /// Roll, pitch, yaw.
    pub(super) angles_rad: Vector,
}

/// A trunk in a person's hands: roll, pitch and yaw, rad.
#[derive(Debug, Default)]
struct HandTilt {
    now_rad: Vector,
    to_rad: Vector,
    at_ns: u64,
}

impl HandTilt {
    fn is_turning(&self) -> bool {
        self.now_rad.iter().zip(self.to_rad).any(|(now, to)| (to - now).abs() > 1e-9)
    }

    /// Moves each angle towards its target, all at the same speed.
    fn step(&mut self, at_ns: u64) -> Truth {
        let dt_s = std::time::Duration::from_nanos(at_ns.saturating_sub(self.at_ns)).as_secs_f64();
        self.at_ns = at_ns;
        let before = quaternion(self.now_rad);
        let step = HANDS_RAD_S * dt_s;
        self.now_rad = std::array::from_fn(|axis| {
            self.now_rad[axis] + (self.to_rad[axis] - self.now_rad[axis]).clamp(-step, step)
        });
        let rotation = quaternion(self.now_rad);
        let [bx, by, bz, bw] = before;
        // The small rotation since the last step, in the trunk's axes.
        let [x, y, z, w] = product([-bx, -by, -bz, bw], rotation);
        let rate = |part: f64| if dt_s > 0.0 { 2.0 * part * w.signum() / dt_s } else { 0.0 };
        let [rx, ry, rz, rw] = rotation;
        Truth {
            at_ns,
            rotation,
            rate_rad_s: [rate(x), rate(y), rate(z)],
            force_m_s2: turned([-rx, -ry, -rz, rw], [0.0, 0.0, GRAVITY]),
        }
    }
}

#[derive(Debug)]
pub(super) struct Sense {
    hands: HandTilt,
    config: ImuConfig,
    delay_ns: u64,
    /// Past truths, oldest first; as many as the delay needs.
    past: VecDeque<Truth>,
    /// Sum and number of the forces since the last output.
    force_sum: (Vector, f64),
    force_bias: Vector,
    rate_bias: Vector,
    drift: Vector,
    rng: Pcg64Mcg,
}

impl Sense {
    pub(super) fn new(config: &ImuConfig, mut rng: Pcg64Mcg) -> Sense {
        let force_bias = noise(&mut rng, config.acceleration_bias_m_s2);
        let rate_bias = noise(&mut rng, config.rate_bias_rad_s);
        let mut drift = noise(&mut rng, config.angle_drift_rad);
        drift[2] = 0.0;
        Sense {
            hands: HandTilt::default(),
            delay_ns: nanoseconds(config.delay_s),
            config: config.clone(),
            past: VecDeque::new(),
            force_sum: ([0.0; 3], 0.0),
            force_bias,
            rate_bias,
            drift,
            rng,
        }
    }

    /// From now on hands turn the trunk to this roll, pitch and yaw, rad, if there is no body.
    pub(super) fn tilt(&mut self, to_rad: Vector) {
        self.hands.to_rad = to_rad;
    }

    /// True while they are turning it.
    pub(super) fn is_tilting(&self) -> bool {
        self.hands.is_turning()
    }

    /// Takes in the result of a motor step. Without a body the trunk is where hands hold it: level at first.
    pub(super) fn observe(&mut self, at_ns: u64, body: Option<&BodyState>) {
        let held = self.hands.step(at_ns);
        let truth = body.map_or(held, |body| Truth {
            at_ns,
            rotation: body.rotation,
            rate_rad_s: body.rate_rad_s,
            force_m_s2: body.specific_force_m_s2,
        });
        self.past.push_back(truth);
        // Once the second entry is old enough to be output, the first is no longer needed.
        while self.past.get(1).is_some_and(|next| next.at_ns + self.delay_ns <= at_ns) {
            self.past.pop_front();
        }
        if let Some(told) = self.past.front().filter(|told| told.at_ns + self.delay_ns <= at_ns) {
            let (sum, count) = &mut self.force_sum;
            sum.iter_mut().zip(told.force_m_s2).for_each(|(sum, force)| *sum += force);
            *count += 1.0;
        }
    }

    /// The output that is due now, `period_s` after the last; `None` before the first measurement.
    pub(super) fn measure(&mut self, period_s: f64) -> Option<Measurement> {
        let told = *self.past.front()?;
        // An accelerometer's own filter passes no more than the output rate: so this is the mean since the last
        // output.
        let (sum, count) = std::mem::take(&mut self.force_sum);
        let force = if count > 0.0 { sum.map(|sum| sum / count) } else { told.force_m_s2 };
        let config = &self.config;
        let [x, y, z, w] = config.rotation;
        let to_unit = [-x, -y, -z, w];
        let force_noise = noise(&mut self.rng, config.acceleration_noise_m_s2);
        let rate_noise = noise(&mut self.rng, config.rate_noise_rad_s);
        let angle_noise = noise(&mut self.rng, config.angle_noise_rad);
        self.drift(period_s);
        // Rotates from the unit's axes to the trunk's to the world's.
        let angles = roll_pitch_yaw(product(told.rotation, self.config.rotation));
        Some(Measurement {
            force_m_s2: sum3(turned(to_unit, force), sum3(force_noise, self.force_bias)),
            rate_rad_s: sum3(turned(to_unit, told.rate_rad_s), sum3(rate_noise, self.rate_bias)),
            angles_rad: sum3(angles, sum3(angle_noise, self.drift)),
        })
    }

    /// Gravity pulls the drift of roll and pitch back; nothing pulls yaw back.
    fn drift(&mut self, dt_s: f64) {
        let fade = (1.0 - dt_s / DRIFT_S).max(0.0);
        let stir = self.config.angle_drift_rad * (1.0 - fade * fade).max(0.0).sqrt();
        let step = noise(&mut self.rng, stir);
        let kept = [fade, fade, 1.0];
        self.drift = std::array::from_fn(|axis| kept[axis] * self.drift[axis] + step[axis]);
    }
}

/// Three numbers with this standard deviation, close to normal: each is the sum of twelve uniform ones, which is
/// the same on every machine.
fn noise(rng: &mut Pcg64Mcg, deviation: f64) -> Vector {
    std::array::from_fn(|_| deviation * ((0..12).map(|_| rng.random_range(0.0..1.0_f64)).sum::<f64>() - 6.0))
}

fn sum3(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|axis| a[axis] + b[axis])
}

fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    let ([ax, ay, az, aw], [bx, by, bz, bw]) = (a, b);
    [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]
}

/// The rotation with this roll, pitch and yaw.
fn quaternion([roll, pitch, yaw]: Vector) -> [f64; 4] {
    let about = |axis: usize, angle: f64| {
        let mut turn = [0.0, 0.0, 0.0, (0.5 * angle).cos()];
        turn[axis] = (0.5 * angle).sin();
        turn
    };
    product(product(about(2, yaw), about(1, pitch)), about(0, roll))
}

fn turned(turn: [f64; 4], [x, y, z]: Vector) -> Vector {
    let [tx, ty, tz, tw] = turn;
    let [x, y, z, _] = product(product(turn, [x, y, z, 0.0]), [-tx, -ty, -tz, tw]);
    [x, y, z]
}

/// The angles as the maker defines them: yaw about z, then pitch about the new y, then roll about the new x (WT901
/// datasheet v20-0702, 5.1.4); roll and yaw within half a turn, pitch within a quarter.
fn roll_pitch_yaw([x, y, z, w]: [f64; 4]) -> Vector {
    let roll = (2.0 * (w * x + y * z)).atan2(1.0 - 2.0 * (x * x + y * y));
    let pitch = (2.0 * (w * y - z * x)).clamp(-1.0, 1.0).asin();
    let yaw = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
    [roll, pitch, yaw]
}

//! The nearest points of two straight segments.

use glam::DVec3;

/// Shorter segments count as points, m^2.
const POINT_M2: f64 = 1e-18;

/// Positions of the nearest points on `a` and `b`, as shares, 0 to 1, from the first point of each to its
/// second (Ericson, Real-Time Collision Detection, 2005, 5.1.9).
pub fn nearest(a: [DVec3; 2], b: [DVec3; 2]) -> [f64; 2] {
    let (along_a, along_b, between) = (a[1] - a[0], b[1] - b[0], a[0] - b[0]);
    let (square_a, square_b) = (along_a.length_squared(), along_b.length_squared());
    let (on_a, on_b) = (along_a.dot(between), along_b.dot(between));
    if square_a <= POINT_M2 {
        return [0.0, if square_b <= POINT_M2 { 0.0 } else { (on_b / square_b).clamp(0.0, 1.0) }];
    }
    if square_b <= POINT_M2 {
        return [(-on_a / square_a).clamp(0.0, 1.0), 0.0];
    }
    let dot = along_a.dot(along_b);
    let area = square_a * square_b - dot * dot;
    // For parallel segments any share is right.
    let free = if area > 1e-12 * square_a * square_b { (dot * on_b - on_a * square_b) / area } else { 0.0 };
    let share_a = free.clamp(0.0, 1.0);
    let share_b = (dot * share_a + on_b) / square_b;
    if share_b < 0.0 {
        [(-on_a / square_a).clamp(0.0, 1.0), 0.0]
    } else if share_b > 1.0 {
        [((dot - on_a) / square_a).clamp(0.0, 1.0), 1.0]
    } else {
        [share_a, share_b]
    }
}

/// Least distance of two such segments, m.
pub fn distance_m(a: [DVec3; 2], b: [DVec3; 2]) -> f64 {
    let [share_a, share_b] = nearest(a, b);
    a[0].lerp(a[1], share_a).distance(b[0].lerp(b[1], share_b))
}

#[cfg(test)]
mod tests {
    use rand_pcg::Pcg64Mcg;
    use rand_pcg::rand_core::{Rng, SeedableRng};

    use super::*;

    #[test]
    fn no_two_points_of_the_segments_are_closer() {
        let mut source = Pcg64Mcg::seed_from_u64(2);
        let mut draw = move || (source.next_u64() >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
        let steps = 40;
        for index in 0..500 {
            let mut place = || DVec3::new(draw(), draw(), 0.3 * draw());
            let a = [place(), place()];
            let mut b = [place(), place()];
            match index % 4 {
                0 => b[1] = b[0],
                1 => b[1] = b[0] + 0.7 * (a[1] - a[0]),
                _ => {}
            }
            let found_m = distance_m(a, b);
            let share = |step: i32| f64::from(step) / f64::from(steps);
            let pairs = (0..=steps).flat_map(|i| (0..=steps).map(move |j| (share(i), share(j))));
            let least_m = pairs
                .map(|(i, j)| a[0].lerp(a[1], i).distance(b[0].lerp(b[1], j)))
                .fold(f64::INFINITY, f64::min);
            assert!(found_m <= least_m + 1e-12, "{index}: {found_m} m, by search {least_m} m");
            assert!(least_m <= found_m + 0.06, "{index}: {found_m} m, by search {least_m} m");
            assert!((distance_m(b, a) - found_m).abs() < 1e-9, "{index}");
        }
        let crossing = [[DVec3::NEG_X, DVec3::X], [DVec3::NEG_Y, DVec3::Y]];
        assert!(distance_m(crossing[0], crossing[1]) < 1e-15);
    }
}

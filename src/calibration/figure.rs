//! A robot as a stick figure of letters, seen from the side: it shows a person the pose to bring the real one into.

use glam::DVec3;

use crate::model::Robot;

/// Largest width and height, letters; a letter is twice as high as it is wide.
const COLUMNS: usize = 64;
const ROWS: usize = 22;
const LETTER_ASPECT: f64 = 2.0;

/// Lines that draw `robot` with its joints at `pose_rad`: x to the right, so that it looks to the right, z up.
/// Nearer parts, those on its right side, cover the parts behind them.
pub fn figure(robot: &Robot, pose_rad: &[f64]) -> Vec<String> {
    let limbs: Vec<Vec<DVec3>> = robot
        .chains
        .iter()
        .map(|chain| robot.places_in_body(chain, pose_rad[chain.joints.clone()].iter().copied()))
        .collect();
    let all = || limbs.iter().flatten().copied().chain([DVec3::ZERO]);
    let low = all().fold(DVec3::INFINITY, DVec3::min);
    let high = all().fold(DVec3::NEG_INFINITY, DVec3::max);
    let size = (high - low).max(DVec3::splat(1e-6));
    let letters_per_m = ((COLUMNS - 3) as f64 / size.x).min((ROWS - 1) as f64 * LETTER_ASPECT / size.z);
    let place = |point: DVec3| {
        let column = (point.x - low.x) * letters_per_m + 1.0;
        let row = (high.z - point.z) * letters_per_m / LETTER_ASPECT;
        (column, row)
    };
    let mut sheet = vec![vec![' '; COLUMNS]; ROWS];
    let roots: Vec<DVec3> = limbs.iter().filter_map(|limb| limb.first().copied()).collect();
    for pair in roots.windows(2) {
        draw(&mut sheet, place(pair[0]), place(pair[1]), Some('='));
    }
    let mut order: Vec<&Vec<DVec3>> = limbs.iter().collect();
    order.sort_by(|a, b| b[0].y.total_cmp(&a[0].y));
    for limb in order {
        for link in limb.windows(2) {
            draw(&mut sheet, place(link[0]), place(link[1]), None);
        }
        for (index, point) in limb.iter().enumerate() {
            put(&mut sheet, place(*point), if index + 1 == limb.len() { '*' } else { 'o' });
        }
    }
    let mut lines: Vec<String> =
        sheet.into_iter().map(|row| row.into_iter().collect::<String>().trim_end().to_owned()).collect();
    while lines.last().is_some_and(String::is_empty) {
        lines.pop();
    }
    lines
}

/// A line drawn in `letter`, or in letters that follow its direction.
fn draw(sheet: &mut [Vec<char>], from: (f64, f64), to: (f64, f64), letter: Option<char>) {
    let (right, down) = (to.0 - from.0, to.1 - from.1);
    let letter = letter.unwrap_or(match (right.abs(), LETTER_ASPECT * down.abs()) {
        (across, along) if along < 0.4 * across => '-',
        (across, along) if across < 0.4 * along => '|',
        _ if right * down > 0.0 => '\\',
        _ => '/',
    });
    let steps = right.abs().max(down.abs()).ceil().max(1.0);
    let mut step = 0.0;
    while step <= steps {
        put(sheet, (from.0 + right * step / steps, from.1 + down * step / steps), letter);
        step += 1.0;
    }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a place off the sheet is left out"
)]
fn put(sheet: &mut [Vec<char>], (column, row): (f64, f64), letter: char) {
    let place = sheet.get_mut(row.round() as usize).and_then(|row| row.get_mut(column.round() as usize));
    if let Some(place) = place {
        *place = letter;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::marked_pose_rad;

    #[test]
    fn every_link_is_seen_and_fits_the_sheet() {
        let robot =
            crate::config::parse(include_str!("../../config/horse.toml"), "horse.toml").unwrap().robot;
        let lines = figure(&robot, &marked_pose_rad(&robot));
        assert!(lines.len() <= ROWS && lines.iter().all(|line| line.len() <= COLUMNS), "{lines:#?}");
        let count =
            |letter: char| lines.iter().flat_map(|line| line.chars()).filter(|of| *of == letter).count();
        // The legs of both sides coincide: two feet and eight joints are visible.
        assert_eq!((count('*'), count('o')), (2, 8), "{lines:#?}");
        // The fore legs are in front, at the right; the feet are below the trunk.
        let trunk = lines.iter().position(|line| line.contains('=')).unwrap();
        assert!(lines.iter().rposition(|line| line.contains('*')).unwrap() > trunk + 5, "{lines:#?}");
    }

    #[test]
    fn a_straight_line_is_drawn_straight() {
        let mut sheet = vec![vec![' '; 9]; 5];
        draw(&mut sheet, (1.0, 0.0), (1.0, 4.0), None);
        assert!(sheet.iter().all(|row| row[1] == '|'));
        draw(&mut sheet, (0.0, 2.0), (8.0, 2.0), None);
        assert_eq!(sheet[2], vec!['-'; 9]);
        // Off the sheet must not panic.
        draw(&mut sheet, (-5.0, -5.0), (90.0, f64::NAN), None);
    }
}

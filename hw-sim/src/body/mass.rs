//! How heavy a rigid part is, and how its mass lies: the one place that knows the inertia of rods, balls and boxes.

use rapier3d_f64::math::Matrix;
use rapier3d_f64::prelude::{MassProperties, Rotation, Vector};

/// The mass of a rigid part, in the part's frame.
///
/// The three moments belong to a body that can exist: none is larger than the other two together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mass {
    /// Mass, kg, not negative.
    pub mass_kg: f64,
    /// Centre of the mass, m.
    pub center_m: [f64; 3],
    /// Moments of inertia about the three principal axes through the centre, kg m^2, not negative.
    pub principal_kg_m2: [f64; 3],
    /// Rotation from the principal axes to the part's: unit quaternion x, y, z, w.
    pub principal_turn: [f64; 4],
}

impl Mass {
    /// A solid ball.
    pub fn ball(mass_kg: f64, center_m: [f64; 3], radius_m: f64) -> Mass {
        let moment = 0.4 * mass_kg * radius_m * radius_m;
        Mass {
            mass_kg,
            center_m,
            principal_kg_m2: [moment; 3],
            principal_turn: Rotation::IDENTITY.to_array(),
        }
    }

    /// A solid round rod along `along_m`, which is as long as this vector; a ball if it has no length.
    pub fn rod(mass_kg: f64, center_m: [f64; 3], along_m: [f64; 3], radius_m: f64) -> Mass {
        let along_m = Vector::from_array(along_m);
        let length_m = along_m.length();
        if length_m <= 0.0 {
            return Mass::ball(mass_kg, center_m, radius_m);
        }
        let across = mass_kg * (length_m * length_m / 12.0 + radius_m * radius_m / 4.0);
        let along = mass_kg * radius_m * radius_m / 2.0;
        Mass {
            mass_kg,
            center_m,
            principal_kg_m2: [along, across, across],
            principal_turn: Rotation::from_rotation_arc(Vector::X, along_m / length_m).to_array(),
        }
    }

    /// A solid box with these edges along x, y and z.
    pub fn cuboid(mass_kg: f64, center_m: [f64; 3], edges_m: [f64; 3]) -> Mass {
        let [x, y, z] = edges_m;
        let moments = Vector::new(y * y + z * z, x * x + z * z, x * x + y * y) * (mass_kg / 12.0);
        Mass {
            mass_kg,
            center_m,
            principal_kg_m2: moments.to_array(),
            principal_turn: Rotation::IDENTITY.to_array(),
        }
    }

    /// Takes `share` of this mass out as a solid ball at `place_m`: the rest, and the ball. Put together again they
    /// have the mass, the centre and the inertia of before. `None` if the mass of no body lies like the rest.
    pub fn split(&self, share: f64, place_m: [f64; 3], radius_m: f64) -> Option<(Mass, Mass)> {
        let ball = Mass::ball(share * self.mass_kg, place_m, radius_m);
        let mass_kg = self.mass_kg - ball.mass_kg;
        let (whole_m, place_m) = (Vector::from_array(self.center_m), Vector::from_array(place_m));
        let center_m = (whole_m * self.mass_kg - place_m * ball.mass_kg) / mass_kg;
        let about = |mass: &Mass, arm: Vector| mass.matrix() + point(mass.mass_kg, arm);
        let rest = about(self, whole_m - center_m) - about(&ball, place_m - center_m);
        // The engine finds the axes of matrices about as large as 1; those of small links it takes for diagonal.
        let largest =
            rest.to_cols_array().into_iter().fold(f64::MIN_POSITIVE, |one, other| one.max(other.abs()));
        let made = MassProperties::with_inertia_matrix(center_m, mass_kg, rest * largest.recip());
        let moments = made.principal_inertia() * largest;
        let rest = Mass {
            mass_kg,
            center_m: center_m.to_array(),
            principal_kg_m2: moments.to_array(),
            principal_turn: made.principal_inertia_local_frame.to_array(),
        };
        // Some room, so that rounding does not make the rest flat.
        let is_solid = rest.thinnest_kg_m2() >= 0.5 * self.thinnest_kg_m2() && self.thinnest_kg_m2() > 0.0;
        is_solid.then_some((rest, ball))
    }

    /// Inertia about the centre, axes of the part's frame, kg m^2: a symmetric matrix.
    pub fn inertia_kg_m2(&self) -> [[f64; 3]; 3] {
        self.matrix().to_cols_array_2d()
    }

    /// Sum of the mass times the squared distance from the centre, along the principal axis where this is least,
    /// kg m^2. A body that can exist has more than 0, unless it is flat.
    fn thinnest_kg_m2(&self) -> f64 {
        let [a, b, c] = self.principal_kg_m2;
        0.5 * (a + b - c).min(b + c - a).min(c + a - b)
    }

    fn matrix(&self) -> Matrix {
        let turn = Matrix::from_quat(Rotation::from_array(self.principal_turn));
        turn * Matrix::from_diagonal(Vector::from_array(self.principal_kg_m2)) * turn.transpose()
    }

    pub(super) fn properties(&self) -> MassProperties {
        MassProperties::with_principal_inertia_frame(
            Vector::from_array(self.center_m),
            self.mass_kg,
            Vector::from_array(self.principal_kg_m2),
            Rotation::from_array(self.principal_turn),
        )
    }
}

/// Inertia of a point of this mass at the end of `arm`, m, about its beginning.
fn point(mass_kg: f64, arm: Vector) -> Matrix {
    let along = Matrix::from_cols(arm * arm.x, arm * arm.y, arm * arm.z);
    (Matrix::from_diagonal(Vector::splat(arm.length_squared())) - along) * mass_kg
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    fn near(matrix: [[f64; 3]; 3], expected: [[f64; 3]; 3]) {
        let pairs = matrix.iter().flatten().zip(expected.iter().flatten());
        assert!(
            pairs.clone().all(|(value, expected)| (value - expected).abs() < 1e-12),
            "{matrix:?} {expected:?}"
        );
    }

    #[test]
    fn a_rod_a_ball_and_a_box_have_the_inertia_of_the_textbook() {
        // 1.2 kg, 2 m upright, radius 0.1 m: 1.2 * (4/12 + 0.01/4) across, 1.2 * 0.01/2 along.
        let rod = Mass::rod(1.2, [0.0; 3], [0.0, 0.0, -2.0], 0.1);
        near(rod.inertia_kg_m2(), [[0.403, 0.0, 0.0], [0.0, 0.403, 0.0], [0.0, 0.0, 0.006]]);
        // A slanted rod is coupled: products of inertia are negative where both coordinates grow together.
        assert!(Mass::rod(1.2, [0.0; 3], [1.0, 0.0, 1.0], 0.1).inertia_kg_m2()[0][2] < 0.0);
        // 10 kg, radius 0.5 m: 0.4 * 10 * 0.25.
        near(
            Mass::ball(10.0, [0.0; 3], 0.5).inertia_kg_m2(),
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        );
        // 12 kg, 1 by 2 by 3 m: 4 + 9, 1 + 9, 1 + 4.
        let cuboid = Mass::cuboid(12.0, [0.0; 3], [1.0, 2.0, 3.0]);
        near(cuboid.inertia_kg_m2(), [[13.0, 0.0, 0.0], [0.0, 10.0, 0.0], [0.0, 0.0, 5.0]]);
    }

    #[test]
    fn a_part_and_the_ball_taken_out_of_it_weigh_and_turn_as_one() {
        // A link, and the short last link of a figure's leg.
        let whole = Mass::rod(0.1, [0.02, 0.01, 0.0], [0.05, 0.0, 0.03], 0.01);
        weigh_and_turn_as_one(whole);
        weigh_and_turn_as_one(Mass::rod(0.03, [0.0156, 0.0, 0.01], [0.0156, 0.0, 0.01], 0.01));
        // No body is left of a rod whose end would have to weigh less than nothing.
        assert_eq!(whole.split(0.5, [1.0, 0.0, 0.0], 0.01), None);
    }

    fn weigh_and_turn_as_one(whole: Mass) {
        let (rest, ball) = whole.split(0.01, [0.0; 3], 0.01).unwrap();
        assert!((rest.mass_kg + ball.mass_kg - whole.mass_kg).abs() < 1e-15);
        assert!((ball.mass_kg - 0.01 * whole.mass_kg).abs() < 1e-15);
        let moment = |part: &Mass| Vector::from_array(part.center_m) * part.mass_kg;
        assert!((moment(&rest) + moment(&ball)).distance(moment(&whole)) < 1e-15);
        let about = |part: &Mass| part.matrix() + point(part.mass_kg, Vector::from_array(part.center_m));
        let together = about(&rest) + about(&ball);
        assert!(together.abs_diff_eq(about(&whole), 1e-15), "{together:?}");
    }
}

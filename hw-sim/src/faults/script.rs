//! A list of faults. Knows no bus: names are looked up when a world is built.

use super::kinds::FaultKind;
use super::mistakes::{FaultError, Mistake, Mistakes};
use crate::body::{Ground, Step};

/// A push of the trunk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScriptedPush {
    /// Force times time, N s, above 0.
    pub impulse_n_s: f64,
    /// How long it lasts, s, above 0.
    pub for_s: f64,
    /// Direction relative to the trunk: rad from ahead to the left. `None` means a new random direction each time,
    /// from the world's seed.
    pub towards_rad: Option<f64>,
    /// The point of the trunk that it acts on, in the trunk's frame, m.
    pub place_m: [f64; 3],
    /// Period after which it comes again, s, above 0; `None` means once.
    pub every_s: Option<f64>,
}

/// Changes to the robot's own ground; a field that is `None` stays as it is.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GroundChange {
    /// Coulomb friction.
    pub friction: Option<f64>,
    /// Slope, rad.
    pub slope_rad: Option<f64>,
    /// Direction uphill, rad from x to the left.
    pub uphill_rad: Option<f64>,
    /// Steps across the robot's path.
    pub steps: Option<Vec<Step>>,
}

impl GroundChange {
    /// Changes `ground`.
    pub(crate) fn apply(&self, ground: &mut Ground) {
        ground.friction = self.friction.unwrap_or(ground.friction);
        ground.slope_rad = self.slope_rad.unwrap_or(ground.slope_rad);
        ground.uphill_rad = self.uphill_rad.unwrap_or(ground.uphill_rad);
        if let Some(steps) = &self.steps {
            ground.steps.clone_from(steps);
        }
    }
}

/// The servos that a fault affects.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Target {
    /// Name of the bus. `None` means every bus or, with an id, the only bus that has it.
    pub bus: Option<String>,
    /// Id of the servo; `None` means every servo.
    pub id: Option<u8>,
    /// Its position in the script.
    pub(super) place: Place,
}

/// Position of a target in the script.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Place {
    /// Index of the fault in the script, from 0.
    pub(super) entry: usize,
    /// Lines, from 1, of its bus and its id.
    pub(super) bus_line: usize,
    pub(super) id_line: usize,
}

/// One entry of a script.
#[derive(Debug, Clone, PartialEq)]
pub struct ScriptedFault {
    /// When it begins, s of virtual time, not negative.
    pub at_s: f64,
    /// How long it lasts, s, above 0; `None` means for good.
    pub for_s: Option<f64>,
    /// The kind of fault.
    pub kind: FaultKind,
    /// The servos it affects.
    pub target: Target,
}

/// A checked list of faults. The default is empty.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FaultScript {
    /// The entries, in the order of the script.
    pub faults: Vec<ScriptedFault>,
    /// Changes to the ground.
    pub ground: GroundChange,
    /// Line of the section that changes the ground.
    pub(super) ground_line: Option<usize>,
    /// Name of the script in errors.
    pub(super) file_name: String,
}

impl FaultScript {
    /// The same script for a robot whose joints carry nothing.
    ///
    /// # Errors
    /// Every push and every change of the ground: they would do nothing.
    pub fn without_body(self) -> Result<FaultScript, FaultError> {
        let expected = "a robot with a body: [physics] in its file, and no --no-physics";
        let pushes = self.faults.iter().filter(|fault| matches!(fault.kind, FaultKind::Push(_)));
        let pushes = pushes.map(|fault| Mistake {
            line: fault.target.place.bus_line,
            key: format!("fault[{}].kind", fault.target.place.entry),
            value: Some("\"push\"".to_owned()),
            expected: expected.to_owned(),
        });
        let ground = self.ground_line.map(|line| Mistake {
            line,
            key: "ground".to_owned(),
            value: Some("a section".to_owned()),
            expected: expected.to_owned(),
        });
        let mut mistakes = Mistakes::default();
        pushes.chain(ground).for_each(|mistake| mistakes.push(mistake));
        mistakes.finish(&self.file_name).map_or(Ok(self), Err)
    }
}

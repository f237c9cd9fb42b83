//! A list of faults. Knows no bus; names are looked up when a world is built.

use super::mistakes::{FaultError, Mistake, Mistakes};
use crate::body::{Ground, Step};

/// What can go wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FaultKind {
    /// The servo neither listens nor answers; its motor goes on as last told.
    Silent,
    /// Replies come late.
    Slow {
        /// By how much, ms.
        delay_ms: f64,
    },
    /// One bit of each reply is flipped on the way to the host; in a fast sync read, of the servo's own block.
    BitFlip,
    /// Every byte of each reply is another.
    Garbled,
    /// What each reply says is another, and its header, id and length are the true ones: one of 256 passes an 8-bit sum.
    Scrambled {
        /// Share of the replies this befalls, 0 to 1.
        share: f64,
    },
    /// Each reply ends before its end.
    CutShort,
    /// Random bytes run ahead of each reply.
    Noise,
    /// The adapter gives the host back what it sends.
    Echo,
    /// The servo takes itself for one with another id: two servos that answer to one id talk over each other.
    WrongId {
        /// Which.
        as_id: u8,
    },
    /// Of a whole bus, the adapter is gone; of one servo, its plug, and with it the supply.
    Unplugged,
    /// The host oversleeps once.
    LateHost {
        /// By how much, ms.
        delay_ms: f64,
    },
    /// The shaft does not turn, whatever the torque.
    Stuck,
    /// The servo's overload protection finds too much load.
    Overload,
    /// The supply of the whole bus is gone; when it is back, the servos start anew.
    BrownOut,
    /// The servo starts anew, once.
    Reset,
    /// The supply of the whole bus has another voltage.
    LowVoltage {
        /// Which, V.
        volts: f64,
    },
    /// Something pushes the trunk.
    Push(ScriptedPush),
    /// The servo has another temperature; afterwards it cools as it would.
    Hot {
        /// Which, °C.
        celsius: f64,
    },
    /// The inertial measurement unit says nothing.
    ImuSilent,
    /// It goes on saying what it said last.
    ImuFrozen,
    /// Every byte it says is another.
    ImuGarbled,
    /// Its adapter is gone.
    ImuUnplugged,
}

/// A push of the trunk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScriptedPush {
    /// Force times time, N s, above 0.
    pub impulse_n_s: f64,
    /// How long it lasts, s, above 0.
    pub for_s: f64,
    /// Where to, as the trunk is turned: rad from ahead to the left. None for somewhere else each time, by the world's
    /// seed.
    pub towards_rad: Option<f64>,
    /// Where on the trunk, in its frame, m.
    pub place_m: [f64; 3],
    /// It comes again after so long, s, above 0; none for once.
    pub every_s: Option<f64>,
}

/// Another ground than the robot's own; what is none stays as it is.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GroundChange {
    /// Coulomb friction.
    pub friction: Option<f64>,
    /// How steep it is, rad.
    pub slope_rad: Option<f64>,
    /// Direction uphill, rad from x to the left.
    pub uphill_rad: Option<f64>,
    /// Steps across the way.
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

/// Which servos a fault befalls.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Target {
    /// Name of the bus. `None` means every bus; beside an id, the only one that has it.
    pub bus: Option<String>,
    /// Id of the servo; `None` means every servo.
    pub id: Option<u8>,
    /// Where in the script it stands.
    pub(super) place: Place,
}

/// Where in a script a target stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Place {
    /// Place of the fault in the script, from 0.
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
    /// What happens.
    pub kind: FaultKind,
    /// To whom.
    pub target: Target,
}

/// A checked list of faults. The default is none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FaultScript {
    /// The entries, in the order of the script.
    pub faults: Vec<ScriptedFault>,
    /// The ground, where the script has another.
    pub ground: GroundChange,
    /// Line of the section that says so.
    pub(super) ground_line: Option<usize>,
    /// What errors call it.
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

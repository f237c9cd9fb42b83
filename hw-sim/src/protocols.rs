//! The list of protocols: the only place that names them all. A further one adds its folder, its variant of
//! [`Protocol`] and its line here.

use std::fmt;
use std::sync::LazyLock;

use crate::model::{Model, Protocol};
use crate::servo::Kind;

/// The protocols, in the order of the variants of [`Protocol`].
static KINDS: &[&Kind] = &[
    &crate::dynamixel::KIND, //
    &crate::feetech::KIND,
];

const _: () = {
    let mut index = 0;
    while index < KINDS.len() {
        assert!(KINDS[index].protocol as usize == index, "the list follows the order of the variants");
        index += 1;
    }
};

static MODELS: LazyLock<Vec<Model>> =
    LazyLock::new(|| KINDS.iter().flat_map(|kind| (kind.models)()).collect());

impl Protocol {
    /// Behaviour of the servos of this protocol.
    pub(crate) fn kind(self) -> &'static Kind {
        KINDS[self as usize]
    }

    /// The protocol of this name, if there is one: `dynamixel` or `feetech`.
    pub fn named(name: &str) -> Option<Protocol> {
        KINDS.iter().find(|kind| kind.name == name).map(|kind| kind.protocol)
    }

    /// Register code of a line rate, if servos can be set to it.
    pub(crate) fn baud_code(self, baud: u32) -> Option<i64> {
        self.kind().bauds.iter().find(|(_, known)| *known == baud).map(|&(code, _)| code)
    }
}

impl fmt::Display for Protocol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind().name)
    }
}

impl Model {
    /// The models that come with the crate.
    pub fn all() -> &'static [Model] {
        &MODELS
    }

    /// The one of this name, if there is one.
    pub fn named(name: &str) -> Option<&'static Model> {
        MODELS.iter().find(|model| model.name == name)
    }
}

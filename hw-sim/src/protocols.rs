//! The list of protocols: the only place that names them all. A further one adds its folder, its variant of
//! [`Protocol`] and its line here.

use std::fmt;
use std::sync::LazyLock;

use crate::model::{Model, Protocol};
use crate::servo::ProtocolSpec;

/// The protocols, in the order of the variants of [`Protocol`].
static PROTOCOLS: &[&ProtocolSpec] = &[
    &crate::dynamixel::SPEC, //
    &crate::feetech::SPEC,
];

const _: () = {
    let mut index = 0;
    while index < PROTOCOLS.len() {
        assert!(PROTOCOLS[index].protocol as usize == index, "the list follows the order of the variants");
        index += 1;
    }
};

static MODELS: LazyLock<Vec<Model>> =
    LazyLock::new(|| PROTOCOLS.iter().flat_map(|spec| (spec.models)()).collect());

impl Protocol {
    /// Behaviour of the servos of this protocol.
    pub(crate) fn spec(self) -> &'static ProtocolSpec {
        PROTOCOLS[self as usize]
    }

    /// The protocol of this name, if there is one: `dynamixel` or `feetech`.
    pub fn named(name: &str) -> Option<Protocol> {
        PROTOCOLS.iter().find(|spec| spec.name == name).map(|spec| spec.protocol)
    }

    /// Register code of a line rate, if servos can be set to it.
    pub(crate) fn baud_code(self, baud: u32) -> Option<i64> {
        self.spec().bauds.iter().find(|(_, known)| *known == baud).map(|&(code, _)| code)
    }
}

impl fmt::Display for Protocol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.spec().name)
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

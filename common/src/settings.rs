//! Settings of picking and of the wave solver.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::accepted::{Interval, WholeRange};
use crate::fields::{self, Condition, Fields, Key, Number, Section};
use crate::limits;
use crate::plausible::{ELEMENT_SIZE, TIME_STEP};

fields::choices!(Extremum, Method);

/// Which extremum of the first arriving packet gives the time of flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Extremum {
    /// E1, the packet's first extremum (the paper's criterion).
    #[default]
    First,
    /// E2, the packet's next extremum.
    Second,
}

impl Extremum {
    /// All criteria, in the order in which messages and documentation list them.
    pub const ALL: [Self; 2] = [Self::First, Self::Second];

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::First => "first",
            Self::Second => "second",
        }
    }

    /// Returns the criterion that this one is not.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::First => Self::Second,
            Self::Second => Self::First,
        }
    }
}

/// The criterion of the first arriving signal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Picking {
    /// The extremum of the packet.
    pub extremum: Extremum,
    /// An extremum can be the first arrival only if its size relative to its packet's peak, in the
    /// median over the receivers, is above this threshold; 0 < threshold < 1.
    pub threshold: f64,
}

impl Default for Picking {
    fn default() -> Self {
        Self { extremum: Extremum::First, threshold: 0.05 }
    }
}

/// Method of computing the transient waves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Exact solution of the layered medium for each frequency and wavenumber.
    #[default]
    Exact,
    /// The paper's method: Fourier in x1, spectral elements in x3, time steps.
    Hybrid,
}

impl Method {
    /// All methods, in the order in which messages and documentation list them.
    pub const ALL: [Self; 2] = [Self::Exact, Self::Hybrid];

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Hybrid => "hybrid",
        }
    }
}

/// Settings of the wave solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverSettings {
    /// The method.
    pub method: Method,
    /// 0.5 to 16: larger is more accurate and slower. With the hybrid method,
    /// element size and time step are divided by its square root.
    pub refinement: f64,
    /// Largest element of the hybrid method along x3 at refinement 1, m, 1e-6 to 1e-2. Other
    /// methods have the default.
    pub element_size: f64,
    /// Polynomial degree of the hybrid method's elements, 2 to 12. Other methods have the default.
    pub element_order: u32,
    /// Time step of the hybrid method's first pass at refinement 1, s, above 0; `None`: chosen from
    /// the stability limit. Other methods have `None`.
    pub time_step: Option<f64>,
}

impl Default for SolverSettings {
    fn default() -> Self {
        Self {
            method: Method::Exact,
            refinement: 1.0,
            element_size: 0.5e-3,
            element_order: 8,
            time_step: None,
        }
    }
}

impl Section for Picking {
    fn declare(&mut self, fields: &mut dyn Fields) {
        let extremum =
            "whether the first or the second extremum of the packet gives the time of flight";
        fields.choice(Key { name: "extremum", meaning: extremum }, &mut self.extremum);
        fields.number(
            Key {
                name: "threshold",
                meaning: "an extremum can be the first arrival only if its size relative to its \
                          packet's peak, in the median over the receivers, is above this; it is lower for \
                          pulses that begin gently \
                          ([physics.md](physics.md#the-first-arriving-signal))",
            },
            &mut self.threshold,
            Number::within(Interval::between(0.0, 1.0, "of the packet's peak")),
        );
    }
}

impl Section for SolverSettings {
    fn declare(&mut self, fields: &mut dyn Fields) {
        let method = "`\"exact\"`: exact solution of the layered medium for each frequency and \
                      wavenumber; `\"hybrid\"`: the paper's method, Fourier transform along the bone, \
                      spectral elements across it, time steps";
        fields.choice(Key { name: "method", meaning: method }, &mut self.method);
        let refinement = "larger is more accurate and slower; with `\"hybrid\"`, element size and \
                          time step are divided by the square root of this value";
        let accepted = Interval::from_to(limits::REFINEMENT_MIN, limits::REFINEMENT_MAX, "");
        fields.number(
            Key { name: "refinement", meaning: refinement },
            &mut self.refinement,
            Number::within(accepted),
        );
        fields.only_if(&only_hybrid(self.method), &mut |fields| self.declare_hybrid(fields));
    }
}

impl SolverSettings {
    fn declare_hybrid(&mut self, fields: &mut dyn Fields) {
        let size = Interval::from_to(limits::ELEMENT_SIZE_MIN, limits::ELEMENT_SIZE_MAX, "m");
        fields.number(
            Key {
                name: "element_size",
                meaning: "largest element size at refinement 1, measured through the thickness; the \
                          first pass uses elements up to a third larger",
            },
            &mut self.element_size,
            Number::plausible(size, &ELEMENT_SIZE),
        );
        fields.whole(
            Key { name: "element_order", meaning: "polynomial degree of the elements" },
            &mut self.element_order,
            WholeRange::new(limits::ELEMENT_ORDER_MIN.into(), limits::ELEMENT_ORDER_MAX.into()),
        );
        fields.optional_number(
            Key {
                name: "time_step",
                meaning: "time step of the first pass; later passes use proportionally smaller \
                          ones. Default: the stability limit of each bone. A step above the stability \
                          limit of a bone makes it fail with `no_convergence`",
            },
            &mut self.time_step,
            Number::above_zero(&TIME_STEP),
        );
    }
}

/// Returns the condition of keys that only the hybrid method has.
fn only_hybrid(method: Method) -> Condition {
    let (given, hybrid) = (method.name(), Method::Hybrid.name());
    Condition {
        holds: method == Method::Hybrid,
        decided_by: "method",
        description: "for `\"hybrid\"`",
        refusal: format!(
            "belongs to the method \"{hybrid}\", and solver.method is \"{given}\"; leave it out, or \
             set solver.method = \"{hybrid}\""
        ),
    }
}

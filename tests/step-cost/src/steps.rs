//! Some steps of every generator, alone and with its angles.

use core::hint::black_box;

use cpg_core::Generator;

use crate::generators::{self, Function, Visitor};

/// Steps of each kind.
const STEPS: u32 = 10;

struct Steps;

impl Visitor for Steps {
    fn generator<G: Generator<N>, const N: usize>(
        &mut self,
        _: &str,
        mut generator: G,
        step: Function<G>,
        tick: Function<G>,
    ) -> bool {
        for function in [step, tick] {
            for _ in 0..STEPS {
                black_box(function)(&mut generator);
            }
        }
        generator.check().is_ok()
    }
}

/// Steps all; false if one cannot be built or has an invalid state afterwards.
pub(crate) fn run() -> bool {
    generators::visit(&mut Steps)
}

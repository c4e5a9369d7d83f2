//! What settings do to the motion, in the numbers that a tick computes with: converted when settings take effect, since a tick would spend a
//! division on each.

use joint_units::{Joint, Radians};

use crate::tuning::parameter::Parameter;
use crate::tuning::settings::Settings;

/// Effect of settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Effect {
    /// Factor on the speed.
    pub(crate) speed: f32,
    /// Factor of each joint, and what is added to it.
    pub(crate) joints: [(f32, Radians); Joint::COUNT],
    /// Whether these change no angle.
    pub(crate) is_none: bool,
}

impl Effect {
    /// That of these settings.
    pub(crate) fn of(settings: &Settings) -> Self {
        let joint = |joint| {
            let degrees = settings.value(Parameter::Offset(joint));
            (settings.value(Parameter::Amplitude(joint)), Radians::from_degrees(degrees))
        };
        let joints = Joint::ALL.map(joint);
        let is_none = joints.iter().all(|(factor, added)| *factor == 1.0 && added.0 == 0.0);
        Self { speed: settings.value(Parameter::Speed), joints, is_none }
    }

    /// The angles with this effect, bit for bit the same where it changes none.
    pub(crate) fn on(
        &self,
        mut angles: [Radians; Joint::COUNT],
        park: &[Radians; Joint::COUNT],
    ) -> [Radians; Joint::COUNT] {
        for ((angle, park), (factor, added)) in angles.iter_mut().zip(park).zip(&self.joints) {
            if *factor != 1.0 || added.0 != 0.0 {
                angle.0 = park.0 + (angle.0 - park.0) * factor + added.0;
            }
        }
        angles
    }

    /// The effect on the way to another one; `weight` is the share of that, 0 to 1.
    pub(crate) fn towards(&self, to: &Self, weight: f32) -> Self {
        let between = |from: f32, to: f32| from + (to - from) * weight;
        let mut now = *to;
        now.speed = between(self.speed, to.speed);
        now.is_none = self.is_none && to.is_none;
        for ((factor, added), (was_factor, was_added)) in now.joints.iter_mut().zip(self.joints) {
            (*factor, added.0) = (between(was_factor, *factor), between(was_added.0, added.0));
        }
        now
    }
}

//! Reads `sensor_msgs/msg/JointState` of ROS 2: a stamp, names of joints, and a position of each.
//!
//! Positions of joints that turn are in radians (ROS REP 103). The definition that the file has of the message decides; where it has
//! none in the language of `.msg` files, the name of the schema does.

use crate::format::mcap_file::cdr::{Cdr, Texts};

/// The name of the schema.
const NAME: &str = "sensor_msgs/msg/JointState";
/// Beginning of the language of definitions that are compared.
const MSG: &str = "ros2msg";
/// Fields of the message. Names of types are without their package.
const FIELDS: [(&str, &str); 5] = [
    ("Header", "header"),
    ("string[]", "name"),
    ("float64[]", "position"),
    ("float64[]", "velocity"),
    ("float64[]", "effort"),
];

/// How the header of the messages is laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    /// A number is in front of the stamp, as in ROS 1.
    has_sequence_number: bool,
}

/// One message.
pub(super) struct JointState {
    /// Nanoseconds of the stamp.
    pub(super) stamp_ns: i64,
    /// The names of the joints, unless they are those of the message before.
    pub(super) new_names: Option<Texts>,
    /// Radians; empty, or as many as there are names.
    pub(super) positions: Vec<f64>,
}

/// The layout if a schema is that of the message; the reason if only its name is.
pub(super) fn layout_of(name: &str, encoding: &str, definition: &[u8]) -> Result<Option<Layout>, String> {
    let is_called = name == NAME || name == "sensor_msgs/JointState";
    let definition = std::str::from_utf8(definition).unwrap_or_default();
    if encoding != MSG || definition.trim().is_empty() {
        return Ok(is_called.then_some(Layout { has_sequence_number: false }));
    }
    let mut parts = parts_of(definition);
    let Some((_, fields)) = parts.next() else { return Ok(None) };
    let header = parts.find(|(name, _)| bare(name) == "Header").map(|(_, fields)| fields);
    let has_sequence_number = match header.as_deref() {
        None | Some([("Time", "stamp"), ("string", "frame_id")]) => Some(false),
        Some([("uint32", "seq"), ("Time", "stamp"), ("string", "frame_id")]) => Some(true),
        Some(_) => None,
    };
    match has_sequence_number.filter(|_| fields == FIELDS) {
        Some(has_sequence_number) => Ok(Some(Layout { has_sequence_number })),
        None if is_called => Err(format!("its definition is not that of {NAME}")),
        None => Ok(None),
    }
}

/// The parts of a definition: the message itself, and the messages in it by name, each with the types and names of its fields.
fn parts_of(definition: &str) -> impl Iterator<Item = (&str, Vec<(&str, &str)>)> {
    definition.split("\n===").map(|part| {
        let mut name = "";
        let mut fields = Vec::new();
        for line in part.lines().map(|line| line.split('#').next().unwrap_or_default().trim_start_matches('=').trim()) {
            let mut words = line.split_whitespace();
            match (words.next(), words.next()) {
                (Some("MSG:"), Some(called)) => name = called,
                (Some(of), Some(field)) if !line.contains('=') && fields.len() < 64 => fields.push((bare(of), field)),
                _ => {}
            }
        }
        (name, fields)
    })
}

/// A type without its package: `builtin_interfaces/Time` gives `Time`.
fn bare(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

impl JointState {
    /// Reads a message; `before` are the names of the joints in the message before it.
    pub(super) fn parse(message: &[u8], layout: Layout, before: &Texts) -> Result<Self, String> {
        let mut cdr = Cdr::new(message)?;
        if layout.has_sequence_number {
            cdr.u32("header.seq")?;
        }
        let (sec, nanosec) = (cdr.i32("header.stamp.sec")?, cdr.u32("header.stamp.nanosec")?);
        if nanosec >= 1_000_000_000 {
            return Err(format!("header.stamp.nanosec is {nanosec}; allowed is below 1000000000"));
        }
        cdr.text("header.frame_id")?;
        let new_names = cdr.new_texts(before, "name")?;
        let names = new_names.as_ref().unwrap_or(before).texts.len();
        let positions = cdr.f64s("position")?;
        if !positions.is_empty() && positions.len() != names {
            return Err(format!(
                "{} positions of {names} joints; allowed are as many as there are names, or none",
                positions.len()
            ));
        }
        Ok(Self { stamp_ns: i64::from(sec) * 1_000_000_000 + i64::from(nanosec), new_names, positions })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const DEFINITION: &str = "# the state of joints\nstd_msgs/Header header # stamp\n\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n\n================================================================================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n================================================================================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";

    #[test]
    fn the_definition_decides_and_without_one_the_name() {
        let of = |name: &str, encoding: &str, text: &str| layout_of(name, encoding, text.as_bytes());
        let plain = Layout { has_sequence_number: false };
        assert_eq!(of(NAME, MSG, DEFINITION), Ok(Some(plain)));
        assert_eq!(of("my_robot/msg/Legs", MSG, DEFINITION), Ok(Some(plain)), "the same fields by another name");
        let numbered = DEFINITION.replace("builtin_interfaces/Time stamp", "uint32 seq\nbuiltin_interfaces/Time stamp");
        assert_eq!(of(NAME, MSG, &numbered), Ok(Some(Layout { has_sequence_number: true })));
        let other = DEFINITION.replace("float64[] position", "float32[] position");
        assert!(of(NAME, MSG, &other).is_err());
        assert_eq!(of("my_robot/msg/Legs", MSG, &other), Ok(None));
        assert_eq!(of(NAME, MSG, ""), Ok(Some(plain)));
        assert_eq!(of(NAME, "ros2idl", "module sensor_msgs {"), Ok(Some(plain)));
        assert_eq!(of("sensor_msgs/msg/Image", "ros2idl", "module sensor_msgs {"), Ok(None));
    }

    /// A message with some of three names, its numbers in one of both byte orders, with one byte that may be changed, cut off somewhere.
    fn messages() -> impl Strategy<Value = Vec<u8>> {
        let names = proptest::collection::vec(proptest::sample::select(vec!["a", "knee", "left_hip"]), 0..3);
        let damage = (0_usize..80, prop_oneof![4 => Just(0_u8), 1 => any::<u8>()]);
        (any::<bool>(), 0_usize..5, names, damage, 0_usize..200).prop_map(
            |(is_big_endian, frame, names, damage, length)| {
                let number = |number: u32| if is_big_endian { number.to_be_bytes() } else { number.to_le_bytes() };
                let mut message = vec![0, u8::from(!is_big_endian), 0, 0, 0, 0, 0, 1, 0, 0, 0, 0];
                let text = |message: &mut Vec<u8>, text: &str| {
                    message.resize(message.len().next_multiple_of(4), 0);
                    message.extend(number(text.len() as u32 + 1));
                    message.extend(text.bytes().chain([0]));
                };
                text(&mut message, &"frame"[..frame]);
                message.resize(message.len().next_multiple_of(4), 0);
                message.extend(number(names.len() as u32));
                names.iter().for_each(|name| text(&mut message, name));
                message.resize(message.len().next_multiple_of(4), 0);
                message.extend(number(names.len() as u32));
                message.resize((message.len() - 4).next_multiple_of(8) + 4, 0);
                message.resize(message.len() + 8 * names.len(), 7);
                let (place, by) = (damage.0 % message.len(), damage.1);
                message[place] ^= by;
                // Mostly whole.
                message.truncate(if length < 100 { length.max(40) } else { usize::MAX });
                message
            },
        )
    }

    proptest! {
        /// A message is what it is without the message before it.
        #[test]
        fn the_names_of_the_message_before_change_nothing(messages in proptest::collection::vec(messages(), 2..6)) {
            let layout = Layout { has_sequence_number: false };
            let mut before = Texts::default();
            for message in &messages {
                let alone = JointState::parse(message, layout, &Texts::default());
                match (JointState::parse(message, layout, &before), alone) {
                    (Err(error), Err(alone)) => prop_assert_eq!(error, alone),
                    (Ok(state), Ok(alone)) => {
                        before = state.new_names.unwrap_or(before);
                        prop_assert_eq!(&before.texts, &alone.new_names.unwrap().texts);
                        let bits = |positions: Vec<f64>| positions.into_iter().map(f64::to_bits).collect::<Vec<_>>();
                        prop_assert_eq!((state.stamp_ns, bits(state.positions)), (alone.stamp_ns, bits(alone.positions)));
                    }
                    (one, other) => prop_assert!(false, "{:?}, alone {:?}", one.err(), other.err()),
                }
            }
        }
    }
}

//! A run for Foxglove: its channels, served by the WebSocket protocol of Foxglove.
//!
//! `tungstenite` speaks WebSocket; the few messages of the protocol are in `protocol.rs`. The crate `foxglove` would bring four times as
//! many crates, an asynchronous runtime among them.

mod client;
mod guard;
mod protocol;
mod queue;
mod server;
mod shared;

use crate::channel::objects::{self, JOINTS, SENSOR, STATE, joints_schema, readings_schema, state_schema};
use crate::channel::{Channel, joint_states, robot_description};
use joint_loop::RobotConfig;
use joint_units::Joint;
use serde_json::Value;
use std::io;
use std::net::SocketAddr;
use wire::Frame;

/// The port that Foxglove proposes.
pub const FOXGLOVE_PORT: u16 = 8765;

/// The topics, in the order of the channels.
pub const CHANNELS: [&str; 6] =
    [SENSOR, JOINTS, STATE, joint_states::TOPIC, joint_states::FOXGLOVE_TOPIC, robot_description::TOPIC];

fn channels(sensors: &[Joint]) -> Vec<Channel> {
    let [sensor, joints, state, ros, foxglove, robot] = CHANNELS;
    vec![
        Channel::json(sensor, "footfall.Readings", &readings_schema(sensors)),
        Channel::json(joints, "footfall.Joints", &joints_schema()),
        Channel::json(state, "footfall.State", &state_schema()),
        Channel::ros(ros, joint_states::JOINT_STATE),
        Channel::json(foxglove, "foxglove.JointStates", &joint_states::foxglove_schema()),
        Channel::ros(robot, robot_description::TEXT),
    ]
}

/// A run that is being served.
pub(super) struct Server {
    port: server::Port,
    /// The robot, as a message, until it is sent.
    robot: Option<Vec<u8>>,
    state: Option<(u32, Value)>,
}

impl Server {
    pub(super) fn open(at: SocketAddr, sensors: &[Joint], robot: &RobotConfig) -> io::Result<Self> {
        let robot = Some(robot_description::text(&robot_description::urdf(robot)));
        Ok(Self { port: server::Port::open(at, channels(sensors))?, robot, state: None })
    }

    /// The address that a client is given.
    pub(super) fn address(&self) -> String {
        self.port.address()
    }

    pub(super) fn frame(&mut self, time_ns: u64, boot: u32, sensors: &[Joint], frame: &Frame) {
        let port = &self.port;
        if let Some(robot) = self.robot.take() {
            port.send_and_keep(5, time_ns, robot);
        }
        let text = |value: Value| value.to_string().into_bytes();
        port.send(0, time_ns, || text(objects::readings(boot, sensors, frame).into()));
        port.send(1, time_ns, || text(objects::joints(boot, frame).into()));
        let state = objects::state(boot, frame);
        let of = (boot, state["state"].clone());
        if self.state.as_ref() != Some(&of) {
            self.state = Some(of);
            port.send_and_keep(2, time_ns, text(state));
        }
        port.send(3, time_ns, || joint_states::joint_state(time_ns, frame.setpoints_rad));
        port.send(4, time_ns, || text(joint_states::foxglove_joint_states(time_ns, frame.setpoints_rad)));
    }

    pub(super) fn finish(self) -> String {
        self.port.close()
    }
}

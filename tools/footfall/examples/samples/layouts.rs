//! Layouts of two viewers, for a run that is sent to them: the robot, setpoints and measured angle, and the state of the supervisor.

use joint_units::Joint;
use serde_json::{Value, json};
use std::fmt::Write as _;

/// Colours of the joints, in their order.
const COLOURS: [&str; Joint::COUNT] = ["#1f77b4", "#d62728", "#2ca02c", "#ff7f0e"];

/// Seconds that a plot shows.
const SECONDS: u32 = 10;

/// A layout of Foxglove, which also fits a capture: the exported file of its menu.
pub(crate) fn foxglove() -> String {
    let path = |value: String, colour: &str| json!({ "value": value, "enabled": true, "timestampMethod": "receiveTime", "color": colour });
    let plot = |title: &str, paths: Vec<Value>| {
        json!({
            "title": title, "paths": paths, "showXAxisLabels": true, "showYAxisLabels": true, "showLegend": true, "legendDisplay": "floating",
            "showPlotValuesInLegend": false, "isSynced": true, "xAxisVal": "timestamp", "sidebarDimension": 240,
            "followingViewWidth": SECONDS,
        })
    };
    let of = |topic: &'static str, prefix: &'static str| {
        Joint::ALL
            .into_iter()
            .zip(COLOURS)
            .map(move |(joint, colour)| path(format!("{topic}.{prefix}{}_deg", joint.name()), colour))
    };
    let robot = json!({
        "layerId": "foxglove.Urdf", "instanceId": "robot", "label": "robot", "visible": true, "sourceType": "topic",
        "topic": "/robot_description", "displayMode": "visual", "order": 1,
    });
    let layout = json!({
        "configById": {
            "3D!robot": {
                "followMode": "follow-none", "followTf": "pelvis", "layers": { "robot": robot }, "topics": {}, "transforms": {}, "scene": {},
                "cameraState": {
                    "distance": 1.2, "phi": 75, "thetaOffset": 60, "targetOffset": [0, 0, -0.2], "target": [0, 0, 0],
                    "targetOrientation": [0, 0, 0, 1], "perspective": true, "fovy": 45, "near": 0.01, "far": 100,
                },
            },
            "Plot!setpoints": plot("setpoints, degrees", of("/joints", "set_").collect()),
            "Plot!measured": plot("measured, degrees", of("/sensor", "").collect()),
            "StateTransitions!state": { "isSynced": true, "paths": [path("/state.state".into(), COLOURS[0])] },
        },
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": { "speed": 1 },
        "layout": {
            "direction": "row", "splitPercentage": 45, "first": "3D!robot",
            "second": {
                "direction": "column", "splitPercentage": 80,
                "first": { "direction": "column", "splitPercentage": 50, "first": "Plot!setpoints", "second": "Plot!measured" },
                "second": "StateTransitions!state",
            },
        },
    });
    format!("{layout:#}\n")
}

/// A layout of PlotJuggler for the datagrams of `watch --udp`. Its reader of JSON puts a slash in front of a field's name.
pub(crate) fn plotjuggler() -> String {
    let degrees = |prefix: &str| Joint::ALL.map(|joint| format!("{prefix}{}_deg", joint.name()));
    let areas = [
        ("setpoints", degrees("set_").to_vec()),
        ("measured", degrees("").to_vec()),
        ("state", vec!["state_number".to_owned()]),
    ];
    let mut text = String::from(
        "<?xml version='1.0' encoding='UTF-8'?>\n<root>\n <tabbed_widget parent=\"main_window\" name=\"Main Window\">\n  \
         <Tab tab_name=\"Footfall\" containers=\"1\">\n   <Container>\n    \
         <DockSplitter orientation=\"-\" sizes=\"0.4;0.4;0.2\" count=\"3\">\n",
    );
    for (name, curves) in areas {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "     <DockArea name=\"{name}\">\n      <plot mode=\"TimeSeries\" style=\"Lines\" flip_x=\"false\" flip_y=\"false\">\n       <limitY/>"
        );
        for (curve, colour) in curves.iter().zip(COLOURS) {
            let _ = writeln!(text, "       <curve name=\"/{curve}\" color=\"{colour}\"/>");
        }
        text += "      </plot>\n     </DockArea>\n";
    }
    text + "    </DockSplitter>\n   </Container>\n  </Tab>\n  <currentTabIndex index=\"0\"/>\n </tabbed_widget>\n \
            <use_relative_time_offset enabled=\"1\"/>\n</root>\n"
}

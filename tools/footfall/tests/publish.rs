//! Runs that are sent to other programs while they run: a client of the WebSocket protocol of Foxglove and a UDP socket get what the board
//! sends, from the virtual board and from a serial port; a client that is slow or absent delays nothing; wrong addresses are named.

mod support;

use footfall::publish::CHANNELS;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use support::{Bench, SimulatedBoard};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};
use wire::Record;

fn walked(secs: u32) -> Vec<String> {
    let mut simulated = SimulatedBoard::new();
    simulated.walk(secs);
    simulated.end();
    simulated.lines
}

/// A program that runs, and what it has said so far.
struct Watched {
    child: Child,
    errors: BufReader<std::process::ChildStderr>,
    said: String,
}

impl Watched {
    fn start(command: &mut Command) -> Self {
        let mut child =
            command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
        let errors = BufReader::new(child.stderr.take().unwrap());
        Self { child, errors, said: String::new() }
    }

    /// The rest of the first line of standard error that begins so.
    fn line(&mut self, prefix: &str) -> String {
        loop {
            let mut line = String::new();
            assert!(self.errors.read_line(&mut line).unwrap() > 0, "no `{prefix}`: {}", self.said);
            self.said += &line;
            if let Some(rest) = line.trim_end().strip_prefix(prefix) {
                return rest.to_owned();
            }
        }
    }

    /// Exit code, the objects on standard output, and all of standard error.
    fn end(mut self) -> (Option<i32>, Vec<Value>, String) {
        let mut text = String::new();
        self.child.stdout.take().unwrap().read_to_string(&mut text).unwrap();
        self.errors.read_to_string(&mut self.said).unwrap();
        let objects = text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
        (self.child.wait().unwrap().code(), objects, self.said)
    }
}

/// A client of Foxglove's protocol that has subscribed to every channel.
struct Client {
    socket: WebSocket<TcpStream>,
    /// The channels by their subscriptions.
    channels: BTreeMap<u32, Value>,
}

impl Client {
    fn connect(address: &str, subprotocol: &'static str) -> Self {
        let stream = TcpStream::connect(address.strip_prefix("ws://").unwrap()).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let mut request = address.into_client_request().unwrap();
        request.headers_mut().insert("sec-websocket-protocol", subprotocol.parse().unwrap());
        let (mut socket, response) = tungstenite::client(request, stream).unwrap();
        assert_eq!(response.headers()["sec-websocket-protocol"], subprotocol);
        let mut text = || serde_json::from_str::<Value>(socket.read().unwrap().to_text().unwrap()).unwrap();
        let info = text();
        assert!(info["op"] == "serverInfo" && info["name"].as_str().unwrap().starts_with("footfall"), "{info}");
        let advertised = text();
        assert_eq!(advertised["op"], "advertise");
        let channels = advertised["channels"].as_array().unwrap();
        assert_eq!(channels.iter().map(|of| of["topic"].as_str().unwrap()).collect::<Vec<_>>(), CHANNELS);
        let channels: BTreeMap<u32, Value> = (100..).zip(channels.iter().cloned()).collect();
        let pairs: Vec<Value> =
            channels.iter().map(|(id, channel)| json!({ "id": id, "channelId": channel["id"] })).collect();
        socket.send(Message::text(json!({ "op": "subscribe", "subscriptions": pairs }).to_string())).unwrap();
        Self { socket, channels }
    }

    /// Waits until the server has read the subscriptions, before the board runs: it answers what came after them.
    fn wait_for_subscriptions(&mut self) {
        self.socket.send(Message::Ping(Vec::new().into())).unwrap();
        let answer = self.socket.read().unwrap();
        assert!(matches!(answer, Message::Pong(_)), "{answer:?}");
    }

    /// The next message: topic, time in ns, payload; `None` when the server has closed the connection.
    fn next(&mut self) -> Option<(String, u64, Vec<u8>)> {
        loop {
            match self.socket.read() {
                Ok(Message::Binary(bytes)) => {
                    assert_eq!(bytes[0], 1);
                    let subscription = u32::from_le_bytes(bytes[1..5].try_into().unwrap());
                    let time_ns = u64::from_le_bytes(bytes[5..13].try_into().unwrap());
                    let topic = self.channels[&subscription]["topic"].as_str().unwrap().to_owned();
                    return Some((topic, time_ns, bytes[13..].to_vec()));
                }
                Ok(Message::Text(text)) => panic!("{text}"),
                Ok(_) => {}
                Err(_) => return None,
            }
        }
    }
}

fn now_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs_f64()
}

/// The text of a message `std_msgs/msg/String`: four bytes of encapsulation, length, text, zero.
fn cdr_text(payload: &[u8]) -> String {
    let length = u32::from_le_bytes(payload[4..8].try_into().unwrap()) as usize;
    assert_eq!(payload.len(), 8 + length);
    String::from_utf8(payload[8..payload.len() - 1].to_vec()).unwrap()
}

#[test]
fn foxglove_gets_joints_state_and_robot_while_the_board_runs() {
    let bench = Bench::paced(&walked(3));
    let began_s = now_s();
    let mut watched = Watched::start(bench.watch().args(["--json", "--secs", "3", "--foxglove", "127.0.0.1:0"]));
    let address = watched.line("foxglove: ");
    let mut client = Client::connect(&address, "foxglove.sdk.v1");
    client.wait_for_subscriptions();
    std::fs::write(bench.path("go"), "").unwrap();
    let mut of: BTreeMap<String, Vec<(u64, Vec<u8>)>> = BTreeMap::new();
    let mut first_at = None;
    while let Some((topic, time_ns, payload)) = client.next() {
        first_at.get_or_insert_with(Instant::now);
        of.entry(topic).or_default().push((time_ns, payload));
    }
    assert!(first_at.unwrap().elapsed() > Duration::from_millis(1500), "messages come while the board runs");
    let (code, objects, said) = watched.end();
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("foxglove: 1 clients") && said.contains(" 0 dropped"), "{said}");
    assert!(bench.text("arguments").contains("--pace"), "in real time");

    // One message a frame, 10 ms apart by the board's clock, of the time at which they came.
    let json = |payload: &[u8]| serde_json::from_slice::<Value>(payload).unwrap();
    let joints = &of["/joints"];
    assert_eq!((joints.len(), of["/sensor"].len(), of["/joint_states"].len()), (300, 300, 300));
    assert!(joints.windows(2).all(|pair| pair[1].0 - pair[0].0 == 10_000_000));
    let seconds = joints[0].0 as f64 / 1e9;
    assert!(seconds >= began_s && seconds <= now_s(), "{seconds}");
    // What `--json` prints for the same tick.
    let ticks: Vec<&Value> = objects.iter().filter(|object| object["type"] == "tick").collect();
    assert_eq!(ticks.len(), 30);
    for tick in ticks {
        let at = joints.iter().position(|(_, payload)| json(payload)["tick"] == tick["tick"]).expect("the same tick");
        let (message, sensor) = (json(&joints[at].1), json(&of["/sensor"][at].1));
        let states = json(&of["/foxglove_joint_states"][at].1);
        assert_eq!(sensor["left_knee_validity"], tick["validity"]);
        for (n, joint) in ["left_hip", "right_hip", "left_knee", "right_knee"].iter().enumerate() {
            let degrees = tick["setpoint_deg"][n].as_f64().unwrap();
            assert!((message[format!("set_{joint}_deg")].as_f64().unwrap() - degrees).abs() < 1e-4);
            assert_eq!(message[format!("{joint}_us")], tick["commanded_us"][n]);
            assert_eq!(states["joints"][n]["name"], format!("set_{joint}"));
            assert!((states["joints"][n]["position"].as_f64().unwrap() - degrees.to_radians()).abs() < 1e-6);
        }
        let stamp = &states["timestamp"];
        assert_eq!(stamp["sec"].as_u64().unwrap() * 1_000_000_000 + stamp["nsec"].as_u64().unwrap(), joints[at].0);
    }
    let states: Vec<Value> = of["/state"].iter().map(|(_, payload)| json(payload)["state"].clone()).collect();
    assert_eq!(states, ["disarmed", "arming", "walking"]);
    let robot = cdr_text(&of["/robot_description"][0].1);
    assert!(robot.matches("<joint ").count() == 4 && robot.contains("set_left_hip"), "{robot}");
    // Each field of a message is in the definition that was advertised.
    for (_, channel) in client.channels.iter().filter(|(_, channel)| channel["encoding"] == "json") {
        let schema: Value = serde_json::from_str(channel["schema"].as_str().unwrap()).unwrap();
        let message = json(&of[channel["topic"].as_str().unwrap()][0].1);
        for field in message.as_object().unwrap().keys() {
            assert!(schema["properties"][field].is_object(), "{}: {field}", channel["topic"]);
        }
    }
}

/// Who comes late gets the robot and the state at once; who speaks another version is refused; other requests are answered.
#[test]
fn late_and_foreign_clients_are_served_or_refused() {
    let bench = Bench::paced(&walked(4));
    let mut watched = Watched::start(bench.watch().args(["--json", "--secs", "4", "--foxglove", "127.0.0.1:0"]));
    let address = watched.line("foxglove: ");
    std::fs::write(bench.path("go"), "").unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    let mut client = Client::connect(&address, "foxglove.websocket.v1");
    let first: Vec<String> = (0..2).map(|_| client.next().unwrap().0).collect();
    assert!(first.contains(&"/robot_description".into()) && first.contains(&"/state".into()), "{first:?}");

    let mut request = address.as_str().into_client_request().unwrap();
    request.headers_mut().insert("sec-websocket-protocol", "foxglove.sdk.v99".parse().unwrap());
    let stream = TcpStream::connect(address.strip_prefix("ws://").unwrap()).unwrap();
    let refused = tungstenite::client(request, stream).map(|_| ()).unwrap_err().to_string();
    assert!(refused.contains("400"), "{refused}");

    client
        .socket
        .send(Message::text(json!({ "op": "subscribe", "subscriptions": [{ "id": 1, "channelId": 99 }] }).to_string()))
        .unwrap();
    let answer = loop {
        if let Message::Text(text) = client.socket.read().unwrap() {
            break serde_json::from_str::<Value>(&text).unwrap();
        }
    };
    assert_eq!((&answer["op"], &answer["message"]), (&"status".into(), &"there is no channel 99".into()));
    // A client that leaves in the middle of the run ends nothing.
    drop(client);
    let (code, _, said) = watched.end();
    assert_eq!(code, Some(0), "{said}");
}

/// Asks for a connection with these headers, at the place of an address of which it may leave parts.
fn ask(address: &str, path: &str, headers: &[(&'static str, &str)]) -> Result<(), String> {
    let place = address.strip_prefix("ws://").unwrap().split('/').next().unwrap().replace("0.0.0.0", "127.0.0.1");
    let mut request = format!("ws://{place}{path}").into_client_request().unwrap();
    request.headers_mut().insert("sec-websocket-protocol", "foxglove.sdk.v1".parse().unwrap());
    for (name, value) in headers {
        request.headers_mut().insert(*name, value.parse().unwrap());
    }
    let stream = TcpStream::connect(&place).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    tungstenite::client(request, stream).map(drop).map_err(|error| error.to_string())
}

/// Any page in the browser of who looks at a run can ask for a connection to this machine.
#[test]
fn a_page_of_a_foreign_origin_is_refused() {
    let bench = Bench::paced(&walked(3));
    let mut watched = Watched::start(bench.watch().args(["--json", "--secs", "3", "--foxglove", "127.0.0.1:0"]));
    let address = watched.line("foxglove: ");
    for headers in [
        &[("origin", "https://evil.example")][..],
        &[("origin", "null")],
        &[("host", "evil.example:8765")],
        &[("host", "evil.example:8765"), ("origin", "http://evil.example:8765")],
    ] {
        let refused = ask(&address, "", headers).unwrap_err();
        assert!(refused.contains("403"), "{headers:?}: {refused}");
    }
    for headers in
        [&[][..], &[("origin", "https://app.foxglove.dev")], &[("origin", "file://")], &[("host", "localhost:9000")]]
    {
        assert_eq!(ask(&address, "", headers), Ok(()), "{headers:?}");
    }
    std::fs::write(bench.path("go"), "").unwrap();
    let (code, _, said) = watched.end();
    assert!(code == Some(0) && said.contains("; 4 refused, the last of them host `evil.example:8765`"), "{said}");
}

/// Where other machines reach the server, what is printed has a token, and nothing else is let in.
#[test]
fn on_other_addresses_a_token_is_asked_for() {
    let bench = Bench::paced(&walked(2));
    let mut watched = Watched::start(bench.watch().args(["--json", "--secs", "2", "--foxglove", "0.0.0.0:0"]));
    let address = watched.line("foxglove: ");
    let path = &address[address.find("/?token=").expect("a token")..];
    assert_eq!(ask(&address, path, &[("origin", "https://viewer.lab"), ("host", "robot.lab:8765")]), Ok(()));
    for bad in ["", "/?token=0123", &path[..path.len() - 1]] {
        let refused = ask(&address, bad, &[]).unwrap_err();
        assert!(refused.contains("403"), "{bad}: {refused}");
    }
    std::fs::write(bench.path("go"), "").unwrap();
    let (code, _, said) = watched.end();
    assert_eq!(code, Some(0), "{said}");
}

/// Connections that ask for nothing, with and without a handshake, are more than there are places; who comes after them is served, and who was
/// served before stays.
#[test]
fn idle_clients_shut_nobody_out() {
    let bench = Bench::paced(&walked(2));
    let mut watched = Watched::start(bench.watch().args(["--json", "--secs", "2", "--foxglove", "127.0.0.1:0"]));
    let address = watched.line("foxglove: ");
    let mut before = Client::connect(&address, "foxglove.sdk.v1");
    before.wait_for_subscriptions();
    let place = address.strip_prefix("ws://").unwrap();
    let _idle: Vec<TcpStream> = (0..40).map(|_| TcpStream::connect(place).unwrap()).collect();
    for _ in 0..20 {
        assert_eq!(ask(&address, "", &[]), Ok(()));
    }
    let mut after = Client::connect(&address, "foxglove.sdk.v1");
    after.wait_for_subscriptions();
    std::fs::write(bench.path("go"), "").unwrap();
    for client in [&mut before, &mut after] {
        let joints = std::iter::from_fn(|| client.next()).filter(|(topic, ..)| topic == "/joints").count();
        assert_eq!(joints, 200);
    }
    let (code, _, said) = watched.end();
    assert_eq!(code, Some(0), "{said}");
}

/// A client that never reads, and a receiver that does not exist: the run has every frame, and ends when it would.
#[test]
fn a_slow_or_absent_client_delays_nothing() {
    let lines = walked(20);
    let length = |of: &[&str]| {
        let bench = Bench::plays(&lines);
        let began = Instant::now();
        let (code, objects, said) = Watched::start(bench.watch().args(["--json", "--secs", "20"]).args(of)).end();
        assert_eq!(code, Some(0), "{said}");
        assert_eq!(objects.last().unwrap()["ticks"], 20_000, "{said}");
        began.elapsed()
    };
    let alone = length(&[]);
    let absent = length(&["--udp", "127.0.0.1:9", "--foxglove", "127.0.0.1:0"]);
    assert!(absent < 2 * alone + Duration::from_secs(2), "{alone:?} {absent:?}");

    let bench = Bench::plays(&lines);
    // The board of the bench writes as fast as it can, once a client is there.
    let script = std::fs::read_to_string(bench.path("board")).unwrap();
    let folder = bench.folder.path().display();
    let waits = script.replacen("cat ", &format!("while [ ! -e {folder}/go ]; do sleep 0.02; done\ncat "), 1);
    std::fs::write(bench.path("board"), waits).unwrap();
    let mut watched = Watched::start(bench.watch().args(["--json", "--secs", "20", "--foxglove", "127.0.0.1:0"]));
    let address = watched.line("foxglove: ");
    let mut client = Client::connect(&address, "foxglove.sdk.v1");
    // More than the system's buffers between the two hold: 100 copies of a message with each frame.
    let pairs: Vec<Value> = (1000..1100).map(|id| json!({ "id": id, "channelId": 1 })).collect();
    client.socket.send(Message::text(json!({ "op": "subscribe", "subscriptions": pairs }).to_string())).unwrap();
    std::thread::sleep(Duration::from_millis(300));
    std::fs::write(bench.path("go"), "").unwrap();
    let began = Instant::now();
    let (code, objects, said) = watched.end();
    let slow = began.elapsed();
    drop(client);
    assert_eq!((code, &objects.last().unwrap()["ticks"]), (Some(0), &20_000.into()), "{said}");
    assert!(slow < 2 * alone + Duration::from_secs(3), "{alone:?} {slow:?}");
    let dropped = said.lines().find_map(|line| line.strip_suffix(" dropped")).expect("a count");
    let dropped: u64 = dropped.rsplit(' ').next().unwrap().parse().unwrap();
    assert!(dropped > 1000, "{said}");
}

/// Receives datagrams until none comes for a second.
fn receive(socket: &UdpSocket) -> Vec<Value> {
    socket.set_read_timeout(Some(Duration::from_secs(1))).unwrap();
    let mut buffer = [0; 2048];
    let mut objects = Vec::new();
    while let Ok(length) = socket.recv(&mut buffer) {
        // The UDP server of PlotJuggler reads 2048 bytes of a datagram.
        assert!(length < 2048);
        objects.push(serde_json::from_slice(&buffer[..length]).unwrap());
    }
    objects
}

/// Flat objects of numbers and texts with a time in seconds, one a frame.
fn assert_plotted(objects: &[Value], began_s: f64) {
    for pair in objects.windows(2) {
        let step = pair[1]["timestamp"].as_f64().unwrap() - pair[0]["timestamp"].as_f64().unwrap();
        assert!((step - 0.010).abs() < 1e-5, "{step}");
    }
    for object in objects {
        let seconds = object["timestamp"].as_f64().unwrap();
        assert!(seconds >= began_s && seconds < now_s() + 60.0, "{seconds} {began_s}");
        assert!(object.as_object().unwrap().values().all(|value| value.is_number() || value.is_string()), "{object}");
    }
}

#[test]
fn every_frame_is_a_datagram() {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let bench = Bench::paced(&walked(3));
    std::fs::write(bench.path("go"), "").unwrap();
    let began_s = now_s();
    let to = socket.local_addr().unwrap().to_string();
    let watched = Watched::start(bench.watch().args(["--json", "--secs", "3", "--udp", &to]));
    let objects = receive(&socket);
    let (code, lines, said) = watched.end();
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains(&format!("udp: 300 datagrams sent to {to}, 0 dropped")), "{said}");
    assert_eq!(objects.len(), 300);
    assert_plotted(&objects, began_s);
    for tick in lines.iter().filter(|object| object["type"] == "tick") {
        let object = objects.iter().find(|object| object["tick"] == tick["tick"]).expect("the same tick");
        assert_eq!((&object["state"], &object["late"]), (&tick["state"], &tick["late_ticks"]));
        for (n, joint) in ["left_hip", "right_hip", "left_knee", "right_knee"].iter().enumerate() {
            let degrees = tick["setpoint_deg"][n].as_f64().unwrap();
            assert!((object[format!("set_{joint}_deg")].as_f64().unwrap() - degrees).abs() < 1e-4);
        }
    }
    let numbers: Vec<&Value> = objects.iter().map(|object| &object["state_number"]).collect();
    assert_eq!((numbers[0], numbers[299]), (&1.into(), &3.into()), "disarmed, walking");
}

/// A serial port: a pseudo-terminal at whose other end records are written.
#[test]
fn a_serial_port_is_sent_too() {
    let near = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&near).unwrap();
    unlockpt(&near).unwrap();
    let path = ptsname(&near, Vec::new()).unwrap().into_string().unwrap();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let to = socket.local_addr().unwrap().to_string();
    let began_s = now_s();
    let mut command = Command::new(env!("CARGO_BIN_EXE_footfall"));
    command.args(["watch", "--serial", &path, "--secs", "0.5", "--udp", &to, "--foxglove", "127.0.0.1:0"]);
    let mut watched = Watched::start(&mut command);
    let mut client = Client::connect(&watched.line("foxglove: "), "foxglove.sdk.v1");
    watched.line("udp: ");
    std::thread::sleep(Duration::from_millis(300));
    let mut port = File::from(near);
    let mut frame = default_frame();
    for n in 1..=60 {
        (frame.tick, frame.seq) = (n * 10, n * 10);
        frame.setpoints_rad[0] = n as f32 / 100.0;
        let mut buffer = [0; wire::MAX_FRAME_BYTES];
        port.write_all(wire::frame_record(&Record::Frame(frame), &mut buffer).unwrap()).unwrap();
        std::thread::sleep(Duration::from_millis(5));
    }
    let mut joints = Vec::new();
    while let Some((topic, _, payload)) = client.next() {
        if topic == "/joints" {
            joints.push(serde_json::from_slice::<Value>(&payload).unwrap());
        }
    }
    let (code, _, said) = watched.end();
    assert_eq!(code, Some(0), "{said}");
    let objects = receive(&socket);
    assert!(objects.len() >= 51 && joints.len() >= 51, "{} {} {said}", objects.len(), joints.len());
    assert_plotted(&objects, began_s);
    assert_eq!(objects[49]["tick"], 500);
    assert!((objects[49]["set_left_hip_deg"].as_f64().unwrap() - 0.5_f64.to_degrees()).abs() < 1e-3);
    assert_eq!(joints[49]["set_left_hip_deg"], objects[49]["set_left_hip_deg"]);
}

/// A frame of a board that walks.
fn default_frame() -> wire::Frame {
    let mut joints = footfall::board::default_loop::typical_loop().unwrap();
    joints.tick(&joint_loop::Sample::default());
    wire::Frame::from(&joints.frame())
}

#[test]
fn wrong_addresses_and_ports_in_use_are_named() {
    let bench = Bench::plays(&walked(1));
    let holder = TcpListener::bind("127.0.0.1:0").unwrap();
    let busy = holder.local_addr().unwrap().to_string();
    for (option, value, words) in [
        ("--foxglove", busy.as_str(), "cannot be opened: Address already in use"),
        ("--foxglove", "192.0.2.1:8765", "allowed is a free port of an address of this machine"),
        ("--foxglove", "127.0.0.1:99999", "allowed is HOST or HOST:PORT, such as 127.0.0.1:8765"),
        ("--udp", "127.0.0.1:x", "allowed is HOST or HOST:PORT, such as 127.0.0.1:9870"),
        ("--udp", "127.0.0.1:0", "port 0; allowed is 1 to 65535"),
    ] {
        let (code, objects, said) = Watched::start(bench.watch().args(["--json", option, value])).end();
        assert_eq!((code, objects.len()), (Some(2), 0), "{said}");
        assert!(said.contains(words) && said.contains(option), "{said}");
        assert!(!bench.path("arguments").exists(), "no board was started");
    }
}

/// The layouts name topics and fields that are sent.
#[test]
fn layouts_name_what_is_sent() {
    let sample = |name: &str| {
        std::fs::read_to_string(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../samples").join(name))
            .unwrap()
    };
    let joints = joint_units::Joint::ALL;
    let mut frame = default_frame();
    frame.sensors = [Some(wire::Reading { angle_rad: 0.1, validity: hgod_adc::Validity::Good }); 4];
    let fields = footfall::publish::fields(0, 1, &joints, &frame);

    let layout: Value = serde_json::from_str(&sample("foxglove-layout.json")).unwrap();
    let panels = layout["configById"].as_object().unwrap();
    let mut leaves = Vec::new();
    let mut nodes = vec![&layout["layout"]];
    while let Some(node) = nodes.pop() {
        match node.as_str() {
            Some(panel) => leaves.push(panel),
            None => nodes.extend([&node["first"], &node["second"]]),
        }
    }
    leaves.sort_unstable();
    assert_eq!(leaves, panels.keys().map(String::as_str).collect::<Vec<_>>());
    let mut paths = 0;
    for path in panels.values().flat_map(|panel| panel["paths"].as_array().into_iter().flatten()) {
        let (topic, field) = path["value"].as_str().unwrap().split_once('.').unwrap();
        assert!(CHANNELS.contains(&topic) && fields.contains_key(field), "{path}");
        paths += 1;
    }
    assert_eq!(paths, 9);
    assert_eq!(panels["3D!robot"]["layers"]["robot"]["topic"], CHANNELS[5]);

    let xml = sample("plotjuggler-layout.xml");
    let mut reader = quick_xml::Reader::from_str(&xml);
    let mut curves = 0;
    loop {
        match reader.read_event().unwrap() {
            quick_xml::events::Event::Eof => break,
            quick_xml::events::Event::Empty(element) if element.name().as_ref() == "curve" => {
                let name = element.try_get_attribute("name").unwrap().unwrap();
                let name = name.value.into_owned();
                assert!(fields.contains_key(name.strip_prefix('/').unwrap()), "{name}");
                curves += 1;
            }
            _ => {}
        }
    }
    assert_eq!(curves, 9);
}

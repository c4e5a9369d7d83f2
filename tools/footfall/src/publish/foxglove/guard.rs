//! Who may connect. A page of any origin can open a WebSocket to this machine from the browser of who looks at it, and read a person's angles.
//!
//! On a loopback address the page has to be one of Foxglove, of a file or of this machine, and the name that it asked for this machine's own; a
//! program that is no page has no origin. On any other address a token in the address is asked for, which a page does not know.

use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr};
use tungstenite::handshake::server::Request;
use tungstenite::http::header::{HOST, HeaderName, ORIGIN};

/// Origins of Foxglove: its program, and its page.
const ORIGINS: [&str; 3] = ["file://", "https://app.foxglove.dev", "https://studio.foxglove.dev"];

/// The rule of one server.
pub(super) struct Guard {
    /// What a client has to know; `None` on a loopback address.
    token: Option<String>,
}

impl Guard {
    /// The rule for a server at this address, with a new token.
    pub(super) fn at(address: SocketAddr) -> io::Result<Self> {
        if address.ip().is_loopback() {
            return Ok(Self { token: None });
        }
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes).map_err(io::Error::other)?;
        Ok(Self { token: Some(bytes.iter().map(|byte| format!("{byte:02x}")).collect()) })
    }

    /// What follows the address.
    pub(super) fn query(&self) -> String {
        self.token.as_ref().map_or(String::new(), |token| format!("/?token={token}"))
    }

    /// Why a client may not connect, if so.
    pub(super) fn refuses(&self, request: &Request) -> Option<String> {
        let values = |name: HeaderName| {
            let all = request.headers().get_all(name);
            all.iter().map(|value| String::from_utf8_lossy(value.as_bytes()).into_owned()).collect::<Vec<_>>()
        };
        if let Some(token) = &self.token {
            let given = request.uri().query().into_iter().flat_map(|query| query.split('&'));
            let mut given = given.filter_map(|pair| pair.strip_prefix("token="));
            let is_right = given.any(|given| is_equal(given.as_bytes(), token.as_bytes()));
            return (!is_right)
                .then(|| "without the token; allowed is the whole address that the program prints".into());
        }
        let hosts = values(HOST);
        if hosts.is_empty() || !hosts.iter().all(|host| is_this_machine(host)) {
            return Some(format!("host `{}`; allowed are localhost and 127.0.0.1", hosts.join(", ")));
        }
        let foreign = values(ORIGIN).into_iter().find(|origin| !is_allowed(origin));
        foreign
            .map(|origin| format!("a page of `{origin}`; allowed are {} and pages of this machine", ORIGINS.join(", ")))
    }
}

/// The whole of both is looked at, so that the time does not show where they differ.
fn is_equal(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |differs, (a, b)| differs | (a ^ b)) == 0
}

fn is_allowed(origin: &str) -> bool {
    let host = ["http://", "https://"].into_iter().find_map(|scheme| origin.strip_prefix(scheme));
    ORIGINS.contains(&origin) || host.is_some_and(is_this_machine)
}

/// Whether a host, with or without a port, is this machine by its own name for itself.
fn is_this_machine(host: &str) -> bool {
    let is_port = |port: &str| port.parse::<u16>().is_ok();
    if let Some(rest) = host.strip_prefix('[') {
        let Some((ip, port)) = rest.split_once(']') else { return false };
        return ip.parse::<Ipv6Addr>().is_ok_and(|ip| ip.is_loopback())
            && (port.is_empty() || port.strip_prefix(':').is_some_and(is_port));
    }
    let (name, port) = host.split_once(':').map_or((host, None), |(name, port)| (name, Some(port)));
    port.is_none_or(is_port)
        && (name.eq_ignore_ascii_case("localhost") || name.parse::<Ipv4Addr>().is_ok_and(|ip| ip.is_loopback()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(uri: &str, headers: &[(&str, &str)]) -> Request {
        let mut request = Request::builder().uri(uri);
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        request.body(()).unwrap()
    }

    #[test]
    fn on_a_loopback_address_host_and_origin_are_those_of_this_machine_or_of_foxglove() {
        let guard = Guard::at("127.0.0.1:8765".parse().unwrap()).unwrap();
        assert_eq!(guard.query(), "");
        let refused = |host: &str, origin: Option<&str>| {
            let mut headers = vec![("host", host)];
            headers.extend(origin.map(|origin| ("origin", origin)));
            guard.refuses(&request("/", &headers))
        };
        for host in ["127.0.0.1:8765", "localhost:9000", "LOCALHOST", "[::1]:8765", "127.8.9.1"] {
            assert_eq!(refused(host, None), None, "{host}");
        }
        for origin in
            ["file://", "https://app.foxglove.dev", "http://localhost:8080", "http://[::1]:3000", "https://127.0.0.1"]
        {
            assert_eq!(refused("localhost:8765", Some(origin)), None, "{origin}");
        }
        // A name that an attacker has made to mean this machine.
        for host in [
            "evil.example:8765",
            "localhost.evil.example",
            "127.0.0.1.evil.example",
            "192.168.1.5",
            "",
            "[::1",
            "localhost:x",
        ] {
            assert!(refused(host, None).unwrap().contains("host `"), "{host}");
        }
        for origin in [
            "https://evil.example",
            "null",
            "https://app.foxglove.dev.evil.example",
            "http://localhost.evil.example",
            "http://127.0.0.1@evil.example",
            "https://evil.example/file://",
        ] {
            assert!(refused("127.0.0.1:8765", Some(origin)).unwrap().contains(origin), "{origin}");
        }
        assert!(guard.refuses(&request("/", &[])).is_some());
        assert!(guard.refuses(&request("/", &[("host", "localhost"), ("host", "evil.example")])).is_some());
        let two = [("host", "localhost"), ("origin", "file://"), ("origin", "https://evil.example")];
        assert!(guard.refuses(&request("/", &two)).is_some());
    }

    #[test]
    fn on_another_address_the_token_is_asked_for() {
        for address in ["0.0.0.0:1", "192.168.1.5:1", "[::]:1"] {
            let guard = Guard::at(address.parse().unwrap()).unwrap();
            let query = guard.query();
            assert_eq!(query.len(), "/?token=".len() + 32);
            // From any page: it cannot know the token.
            let headers = [("host", "robot.lab:1"), ("origin", "https://viewer.lab")];
            assert_eq!(guard.refuses(&request(&query, &headers)), None);
            assert_eq!(guard.refuses(&request(&query.replace("/?", "/?a=b&"), &[])), None);
            for bad in
                ["/", "/?token=", &query[..query.len() - 1], &query.replace("token", "other"), &(query.clone() + "0")]
            {
                assert!(guard.refuses(&request(bad, &headers)).unwrap().contains("without the token"), "{bad}");
            }
            assert_ne!(Guard::at(address.parse().unwrap()).unwrap().query(), query, "each run has its own");
        }
    }
}

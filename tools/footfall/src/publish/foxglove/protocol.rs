//! The WebSocket protocol of Foxglove (<https://github.com/foxglove/ws-protocol>): the messages that are used.
//!
//! The server names itself and its channels, as JSON in text messages; a client subscribes to channels; messages are binary.

use crate::channel::Channel;
use serde_json::{Value, json};

/// The versions of the protocol that are spoken, in this order of preference. Of the messages used here they have the same form.
const SUBPROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];

/// The version that is chosen from those that a client offers, with commas between them.
pub(super) fn chosen(offered: &str) -> Option<&'static str> {
    SUBPROTOCOLS.into_iter().find(|known| offered.split(',').any(|name| name.trim() == *known))
}

/// What a server says first.
pub(super) fn server_info(session: u64) -> String {
    let name = concat!("footfall ", env!("CARGO_PKG_VERSION"));
    json!({ "op": "serverInfo", "name": name, "capabilities": [], "metadata": {}, "sessionId": session.to_string() })
        .to_string()
}

/// The list of channels; the id of a channel is its place.
pub(super) fn advertise(channels: &[Channel]) -> String {
    let channel = |(id, channel): (usize, &Channel)| {
        json!({
            "id": id, "topic": channel.topic, "encoding": channel.encoding, "schemaName": channel.schema.name,
            "schemaEncoding": channel.schema.encoding, "schema": channel.schema.text,
        })
    };
    json!({ "op": "advertise", "channels": channels.iter().enumerate().map(channel).collect::<Vec<_>>() }).to_string()
}

/// A message on a channel, for a subscription.
pub(super) fn message_data(subscription: u32, time_ns: u64, payload: &[u8]) -> Vec<u8> {
    [&[1], &subscription.to_le_bytes()[..], &time_ns.to_le_bytes(), payload].concat()
}

/// What is wrong with a request, for the client to show.
pub(super) fn warning(text: &str) -> String {
    json!({ "op": "status", "level": 1, "message": text }).to_string()
}

/// A request of a client.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Asked {
    /// Subscriptions, each with its channel.
    Subscribe(Vec<(u32, usize)>),
    /// Ends subscriptions.
    Unsubscribe(Vec<u32>),
}

/// Reads a request; the error says what is not understood.
pub(super) fn asked(text: &str) -> Result<Asked, String> {
    let value: Value = serde_json::from_str(text).map_err(|error| format!("no JSON object: {error}"))?;
    let list = |key: &str| value[key].as_array().ok_or_else(|| format!("`{key}` is no list"));
    let id = |value: &Value| value.as_u64().and_then(|id| u32::try_from(id).ok()).ok_or("an id is no whole number");
    match value["op"].as_str() {
        Some("subscribe") => {
            let pair = |of: &Value| Ok((id(&of["id"])?, id(&of["channelId"])? as usize));
            Ok(Asked::Subscribe(list("subscriptions")?.iter().map(pair).collect::<Result<_, &str>>()?))
        }
        Some("unsubscribe") => {
            Ok(Asked::Unsubscribe(list("subscriptionIds")?.iter().map(id).collect::<Result<_, _>>()?))
        }
        Some(op) => Err(format!("`{op}` is not supported; allowed are subscribe and unsubscribe")),
        None => Err("a request without `op`".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_version_that_both_speak_is_chosen() {
        assert_eq!(chosen("foxglove.websocket.v1"), Some("foxglove.websocket.v1"));
        assert_eq!(chosen("foxglove.websocket.v1, foxglove.sdk.v1"), Some("foxglove.sdk.v1"));
        assert_eq!(chosen("foxglove.sdk.v1.1,foxglove.sdk.v1"), Some("foxglove.sdk.v1"));
        assert_eq!(chosen("foxglove.sdk.v9"), None);
    }

    #[test]
    fn requests_are_read_and_others_refused() {
        let subscribe = r#"{"op":"subscribe","subscriptions":[{"id":7,"channelId":2},{"id":8,"channelId":0}]}"#;
        assert_eq!(asked(subscribe), Ok(Asked::Subscribe(vec![(7, 2), (8, 0)])));
        assert_eq!(asked(r#"{"op":"unsubscribe","subscriptionIds":[7]}"#), Ok(Asked::Unsubscribe(vec![7])));
        for (bad, words) in [
            ("[", "no JSON object"),
            ("{}", "without `op`"),
            (r#"{"op":"advertise"}"#, "`advertise` is not supported; allowed are"),
            (r#"{"op":"subscribe"}"#, "`subscriptions` is no list"),
            (r#"{"op":"subscribe","subscriptions":[{"id":-1,"channelId":2}]}"#, "an id is no whole number"),
        ] {
            let error = asked(bad).unwrap_err();
            assert!(error.contains(words), "{bad}: {error}");
        }
    }

    /// By the table of the specification: opcode, subscription, time, payload, little endian.
    #[test]
    fn a_message_is_laid_out_as_specified() {
        let message = message_data(0x0102_0304, 0x1112_1314_1516_1718, b"ab");
        assert_eq!(message, [1, 4, 3, 2, 1, 0x18, 0x17, 0x16, 0x15, 0x14, 0x13, 0x12, 0x11, b'a', b'b']);
    }
}

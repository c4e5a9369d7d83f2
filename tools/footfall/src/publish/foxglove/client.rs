//! One client of the server: its connection, in a thread of its own.

use super::protocol::{Asked, advertise, asked, chosen, message_data, server_info, warning};
use super::queue::Queue;
use super::shared::{Shared, lock};
use std::io;
use std::net::TcpStream;
use std::sync::atomic::Ordering;
use std::time::Duration;
use tungstenite::handshake::server::{ErrorResponse, Request, Response};
use tungstenite::http::{HeaderValue, StatusCode};
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Error, Message, WebSocket};

/// How long a client may take to say what it wants.
const HANDSHAKE: Duration = Duration::from_secs(5);

/// How long a request is waited for before messages are sent again.
const LISTEN: Duration = Duration::from_millis(5);

/// Longest request, bytes.
const MAX_REQUEST: usize = 1 << 16;

/// The header with the versions of the protocol.
const SUBPROTOCOL: &str = "sec-websocket-protocol";

/// Serves a client until it leaves or the server is closed; the queue is what waits for it.
pub(super) fn serve(stream: TcpStream, shared: &Shared, queue: &Queue) {
    // A client that breaks off ends its own thread and nothing else.
    let _ = connect(stream, shared).and_then(|mut socket| talk(&mut socket, shared, queue));
}

fn connect(stream: TcpStream, shared: &Shared) -> Result<WebSocket<TcpStream>, Error> {
    stream.set_nonblocking(false)?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(HANDSHAKE))?;
    stream.set_write_timeout(Some(HANDSHAKE))?;
    let config = WebSocketConfig::default().max_message_size(Some(MAX_REQUEST)).max_frame_size(Some(MAX_REQUEST));
    #[allow(clippy::result_large_err)] // the type is that of the library's callback
    let agree = |request: &Request, response| match shared.guard.refuses(request) {
        Some(why) => {
            let body = format!("this server does not take a client with {why}");
            let mut refusals = lock(&shared.refusals);
            (refusals.count, refusals.last) = (refusals.count + 1, why);
            Err(refusal(StatusCode::FORBIDDEN, body))
        }
        None => agree(request, response),
    };
    let mut socket = tungstenite::accept_hdr_with_config(stream, agree, Some(config))
        .map_err(|error| Error::Io(io::Error::other(error.to_string())))?;
    socket.send(Message::text(server_info(shared.session)))?;
    socket.send(Message::text(advertise(&shared.channels)))?;
    socket.get_ref().set_read_timeout(Some(LISTEN))?;
    socket.get_ref().set_write_timeout(Some(LISTEN))?;
    Ok(socket)
}

/// Agrees on a version of the protocol.
#[expect(clippy::result_large_err, reason = "the type is that of tungstenite")]
fn agree(request: &Request, mut response: Response) -> Result<Response, ErrorResponse> {
    let headers = request.headers().get_all(SUBPROTOCOL);
    let offered: Vec<&str> = headers.iter().filter_map(|value| value.to_str().ok()).collect();
    let Some(chosen) = chosen(&offered.join(",")) else {
        let body = "this server speaks foxglove.sdk.v1 and foxglove.websocket.v1";
        return Err(refusal(StatusCode::BAD_REQUEST, body.into()));
    };
    response.headers_mut().insert(SUBPROTOCOL, HeaderValue::from_static(chosen));
    Ok(response)
}

fn refusal(status: StatusCode, body: String) -> ErrorResponse {
    let mut refusal = ErrorResponse::new(Some(body));
    *refusal.status_mut() = status;
    refusal
}

/// Whether a socket only asks for patience.
fn is_busy(error: &Error) -> bool {
    matches!(error, Error::Io(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut))
}

/// True for what is done, false for what waits for the socket.
fn done(result: Result<(), Error>) -> Result<bool, Error> {
    match result {
        Ok(()) => Ok(true),
        Err(error) if is_busy(&error) => Ok(false),
        Err(error) => Err(error),
    }
}

fn talk(socket: &mut WebSocket<TcpStream>, shared: &Shared, queue: &Queue) -> Result<(), Error> {
    loop {
        let closing = shared.closing.load(Ordering::Relaxed);
        match socket.read() {
            Ok(Message::Text(text)) => {
                if let Err(why) = obey(text.as_str(), shared, queue) {
                    done(socket.send(Message::text(warning(&why))))?;
                }
            }
            Ok(Message::Close(_)) => return Ok(()),
            Ok(_) => {}
            Err(error) if is_busy(&error) => {}
            Err(error) => return Err(error),
        }
        // The next message is taken when the one before is with the system: the rest waits in the queue, which is bounded.
        while done(socket.flush())? {
            let Some((subscription, message)) = queue.pop() else {
                if closing {
                    socket.close(None)?;
                    return socket.flush();
                }
                break;
            };
            let data = message_data(subscription, message.time_ns, &message.payload);
            done(socket.write(Message::binary(data)))?;
            shared.sent.fetch_add(1, Ordering::Relaxed);
        }
    }
}

fn obey(text: &str, shared: &Shared, queue: &Queue) -> Result<(), String> {
    match asked(text)? {
        Asked::Subscribe(pairs) => {
            for (subscription, channel) in pairs {
                if channel >= shared.channels.len() {
                    return Err(format!("there is no channel {channel}"));
                }
                queue.subscribe(subscription, channel, shared.kept(channel));
            }
        }
        Asked::Unsubscribe(subscriptions) => subscriptions.into_iter().for_each(|id| queue.unsubscribe(id)),
    }
    Ok(())
}

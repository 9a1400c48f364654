//! A raw serial server: bytes of a bus in a TCP connection.

use std::collections::BTreeMap;
use std::io::{self, Read};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::time::Duration;

use socket2::{Domain, Protocol, SockAddr, Socket, TcpKeepalive, Type};

use super::{Clock, Received, Reception, Source, SourceError};

const BUFFER: usize = 16 * 1024;
/// How long a server may take to accept, for each of its addresses.
const CONNECT: Duration = Duration::from_secs(4);

/// Returns how a server that fell silent is probed: nobody sends to it, so nothing else tells that it is dead.
///
/// First after 10 s, then each 5 s; given up after three: gone after 25 s.
fn keepalive() -> TcpKeepalive {
    TcpKeepalive::new()
        .with_time(Duration::from_secs(10))
        .with_interval(Duration::from_secs(5))
        .with_retries(3)
}

/// Receives from a serial server.
pub(super) struct Tcp {
    name: String,
    host: String,
    clock: Arc<dyn Clock>,
    /// What the host's name meant when it was opened: asking again could take long.
    addresses: Vec<SocketAddr>,
    link: Link,
    buffer: Vec<u8>,
}

enum Link {
    Up(TcpStream),
    /// Waiting for the answer of the address of this number.
    Connecting(Socket, usize),
    /// The address of this number is next.
    Down(usize),
}

impl Tcp {
    /// Connects to a server, waiting up to 4 s for each of its addresses.
    ///
    /// # Errors
    /// When the name means no address, or no address accepts.
    pub(super) fn open(
        host: &str,
        port: u16,
        name: String,
        clock: Arc<dyn Clock>,
    ) -> Result<Self, SourceError> {
        let found = (host, port).to_socket_addrs().map(Iterator::collect::<Vec<_>>);
        let addresses = match found {
            Ok(addresses) if !addresses.is_empty() => addresses,
            Ok(_) => return Err(unknown(&name, host, "it has no address")),
            Err(error) => return Err(unknown(&name, host, &error.to_string())),
        };
        let mut link = Err(io::Error::other("no address"));
        for address in &addresses {
            link = TcpStream::connect_timeout(address, CONNECT);
            if link.is_ok() {
                break;
            }
        }
        let stream = link.and_then(prepared).map_err(|error| refused(&name, port, error))?;
        let (host, buffer) = (host.to_owned(), vec![0; BUFFER]);
        Ok(Tcp { name, host, clock, addresses, link: Link::Up(stream), buffer })
    }

    /// Asks the address of this number to connect, without waiting for it.
    fn start(&self, number: usize) -> io::Result<Link> {
        let Some(&address) = self.addresses.get(number) else { return Ok(Link::Down(0)) };
        let socket = Socket::new(Domain::for_address(address), Type::STREAM, Some(Protocol::TCP))?;
        socket.set_nonblocking(true)?;
        match socket.connect(&SockAddr::from(address)) {
            Ok(()) => Ok(Link::Connecting(socket, number)),
            Err(error) if is_under_way(&error) => Ok(Link::Connecting(socket, number)),
            Err(error) => Err(error),
        }
    }
}

impl Source for Tcp {
    fn name(&self) -> &str {
        &self.name
    }

    fn receive(&mut self, timeout: Duration, reception: &mut Reception) -> Result<Received, SourceError> {
        reception.clear();
        let Link::Up(stream) = &mut self.link else {
            reception.stamp(&*self.clock);
            return Ok(Received::Gone);
        };
        let is_ready = wait(stream, timeout);
        reception.stamp(&*self.clock);
        let count = match is_ready {
            Ok(false) => return Ok(Received::Silence),
            Ok(true) => stream.read(&mut self.buffer),
            Err(error) => Err(error),
        };
        match count {
            // Whatever is wrong with a connection, only another one mends it.
            Ok(0) => {}
            Err(error) if error.kind() != io::ErrorKind::Interrupted => {}
            Err(_) => return Ok(Received::Silence),
            Ok(count) => {
                reception.monotonic_ns = self.clock.monotonic_ns();
                reception.bytes.extend_from_slice(self.buffer.get(..count).unwrap_or_default());
                return Ok(Received::Bytes);
            }
        }
        self.link = Link::Down(0);
        Ok(Received::Gone)
    }

    /// Does nothing: the line is set at the server.
    /// Asks one address to connect, or looks whether the one asked before has.
    fn reopen(&mut self) -> Result<(), SourceError> {
        let port = self.addresses.first().map_or(0, SocketAddr::port);
        let (number, result) = match std::mem::replace(&mut self.link, Link::Down(0)) {
            Link::Up(stream) => {
                self.link = Link::Up(stream);
                return Ok(());
            }
            Link::Down(number) => (number, self.start(number)),
            connecting @ Link::Connecting(_, number) => (number, Ok(connecting)),
        };
        let result = result.and_then(|link| match link {
            Link::Connecting(socket, number) => connected(socket, number),
            other => Ok(other),
        });
        let next = number.saturating_add(1) % self.addresses.len().max(1);
        self.link = result.map_err(|error| {
            self.link = Link::Down(next);
            refused(&self.name, port, error)
        })?;
        match self.link {
            Link::Up(_) => Ok(()),
            _ => {
                let error = io::Error::new(io::ErrorKind::WouldBlock, "the server has not answered yet");
                Err(SourceError::new(&self.name, "connect to", error))
            }
        }
    }

    fn facts(&self) -> BTreeMap<String, String> {
        let peer = match &self.link {
            Link::Up(stream) => stream.peer_addr().ok(),
            _ => None,
        };
        let peer = peer.filter(|peer| peer.ip().to_string() != self.host);
        peer.map(|peer| ("server".to_owned(), peer.to_string())).into_iter().collect()
    }
}

#[cfg(unix)]
fn wait(stream: &TcpStream, timeout: Duration) -> io::Result<bool> {
    super::wait::readable(stream, timeout)
}

#[cfg(not(unix))]
fn wait(stream: &TcpStream, timeout: Duration) -> io::Result<bool> {
    stream.set_read_timeout(Some(timeout.max(Duration::from_millis(1))))?;
    match stream.peek(&mut [0]) {
        Ok(_) => Ok(true),
        Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
            Ok(false)
        }
        Err(error) => Err(error),
    }
}

/// Says whether a connection has come about; still under way is no error.
fn connected(socket: Socket, number: usize) -> io::Result<Link> {
    match (socket.take_error()?, socket.peer_addr()) {
        (Some(error), _) => Err(error),
        (None, Err(_)) => Ok(Link::Connecting(socket, number)),
        (None, Ok(_)) => {
            socket.set_nonblocking(false)?;
            Ok(Link::Up(prepared(socket.into())?))
        }
    }
}

fn prepared(stream: TcpStream) -> io::Result<TcpStream> {
    let socket = Socket::from(stream);
    socket.set_tcp_keepalive(&keepalive())?;
    Ok(socket.into())
}

fn is_under_way(error: &io::Error) -> bool {
    #[cfg(unix)]
    if error.raw_os_error() == Some(rustix::io::Errno::INPROGRESS.raw_os_error()) {
        return true;
    }
    error.kind() == io::ErrorKind::WouldBlock
}

fn unknown(name: &str, host: &str, why: &str) -> SourceError {
    let error =
        io::Error::new(io::ErrorKind::NotFound, format!("the name '{host}' cannot be resolved: {why}"));
    SourceError::new(name, "connect to", error).hinted("check the name, or give the server's address")
}

fn refused(name: &str, port: u16, error: io::Error) -> SourceError {
    let hint = match error.kind() {
        io::ErrorKind::ConnectionRefused => Some(format!(
            "nothing listens on port {port}: is the server on, in raw TCP mode, and free of another client?"
        )),
        io::ErrorKind::TimedOut | io::ErrorKind::HostUnreachable | io::ErrorKind::NetworkUnreachable => {
            Some("is the server on, and in this network? A firewall may be between".to_owned())
        }
        _ => None,
    };
    SourceError { hint, ..SourceError::new(name, "connect to", error) }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::net::TcpListener;

    use super::super::SystemClock;
    use super::*;

    const LONG: Duration = Duration::from_secs(20);

    fn server() -> (TcpListener, u16) {
        let server = TcpListener::bind("127.0.0.1:0").expect("a port");
        let port = server.local_addr().expect("an address").port();
        (server, port)
    }

    fn open(host: &str, port: u16) -> Result<Tcp, SourceError> {
        Tcp::open(host, port, format!("tcp://{host}:{port}"), Arc::new(SystemClock))
    }

    fn refusal(host: &str, port: u16) -> SourceError {
        let Err(error) = open(host, port) else { panic!("{host}:{port} accepts") };
        error
    }

    fn receive(source: &mut Tcp) -> (Received, Vec<u8>) {
        let mut reception = Reception::default();
        let received = source.receive(LONG, &mut reception).expect("no failure");
        (received, reception.bytes)
    }

    #[test]
    fn a_server_gives_its_bytes_as_they_are_and_is_gone_when_it_closes() {
        let (server, port) = server();
        let mut source = open("127.0.0.1", port).expect("it accepts");
        let (mut peer, _) = server.accept().expect("a client");
        peer.write_all(&[0x01, 0xff, 0xff, 0x00]).expect("room");
        assert_eq!(receive(&mut source), (Received::Bytes, vec![0x01, 0xff, 0xff, 0x00]));
        let mut reception = Reception::default();
        assert_eq!(source.receive(Duration::ZERO, &mut reception).expect("a wait"), Received::Silence);
        drop(peer);
        assert_eq!(receive(&mut source), (Received::Gone, vec![]));
        assert_eq!(receive(&mut source), (Received::Gone, vec![]), "and stays so");
    }

    #[test]
    fn a_server_that_comes_back_is_found_again_without_waiting_for_it() {
        let (server, port) = server();
        let mut source = open("127.0.0.1", port).expect("it accepts");
        drop(server.accept().expect("a client"));
        drop(server);
        assert_eq!(receive(&mut source).0, Received::Gone);
        let error = source.reopen().expect_err("nobody is there");
        assert!(
            error.to_string().starts_with(&format!("cannot connect to 'tcp://127.0.0.1:{port}': ")),
            "{error}"
        );

        let server = TcpListener::bind(("127.0.0.1", port)).expect("the port of before");
        // An attempt may find the one before still under way.
        let attempts = (0..1000).find(|_| source.reopen().is_ok());
        assert!(attempts.is_some(), "it listens again");
        let (mut peer, _) = server.accept().expect("a client");
        peer.write_all(&[5]).expect("room");
        assert_eq!(receive(&mut source), (Received::Bytes, vec![5]));
    }

    #[test]
    fn a_dead_server_is_noticed_although_nobody_sends_to_it() {
        let (server, port) = server();
        let source = open("127.0.0.1", port).expect("it accepts");
        let _peer = server.accept().expect("a client");
        let Link::Up(stream) = &source.link else { panic!("connected") };
        let socket = socket2::SockRef::from(stream);
        assert!(socket.keepalive().expect("an option"));
        assert_eq!(socket.tcp_keepalive_time().expect("an option"), Duration::from_secs(10));
    }

    #[test]
    fn a_name_without_address_and_a_port_without_listener_are_told_apart() {
        let (server, port) = server();
        drop(server);
        let error = refusal("127.0.0.1", port);
        assert!(error.to_string().contains("refused"), "{error}");
        let hint = error.hint.expect("a hint");
        assert!(hint.starts_with(&format!("nothing listens on port {port}: is the server on")), "{hint}");

        // RFC 6761 keeps .invalid for names that never resolve.
        let error = refusal("no-such-server.invalid", port);
        assert!(
            error.to_string().contains("the name 'no-such-server.invalid' cannot be resolved"),
            "{error}"
        );
    }
}

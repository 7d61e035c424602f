//! The framing of messages that editors exchange with the program.

use std::io::{BufRead, BufReader, Read, Write};
use std::sync::mpsc::{Receiver, channel};

use serde_json::Value as Json;

/// Writes a message.
pub fn send(output: &mut impl Write, text: &str) {
    write!(output, "Content-Length: {}\r\n\r\n{text}", text.len()).unwrap();
    output.flush().unwrap();
}

/// Sends the messages of a stream to a channel.
pub fn received(stream: impl Read + Send + 'static) -> Receiver<Json> {
    let (sender, messages) = channel();
    std::thread::spawn(move || {
        let mut stream = BufReader::new(stream);
        loop {
            let mut head = String::new();
            if stream.read_line(&mut head).unwrap_or(0) == 0 {
                return;
            }
            let length = head.trim().strip_prefix("Content-Length: ").unwrap().parse().unwrap();
            let mut end = String::new();
            stream.read_line(&mut end).unwrap();
            assert_eq!(end, "\r\n");
            let mut body = vec![0; length];
            stream.read_exact(&mut body).unwrap();
            if sender.send(serde_json::from_slice(&body).unwrap()).is_err() {
                return;
            }
        }
    });
    messages
}

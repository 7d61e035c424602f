//! Reads arbitrary bytes as a checkpoint.

use rtsl_render::checkpoint::Checkpoint;

/// The reader. What it accepts it also writes, to the same bytes.
pub fn checkpoint(data: &[u8]) {
    if let Ok(checkpoint) = Checkpoint::from_bytes(data) {
        let mut again = Vec::new();
        checkpoint.write_to(&mut again).expect("memory takes all bytes");
        assert_eq!(again, data);
    }
}

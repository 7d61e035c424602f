//! Machine code as LLVM makes it.

use crate::elf::Object;
use crate::error::JitError;
use crate::frames::Frames;
use crate::module::Module;
use crate::module_key::ModuleKey;

/// The first bytes of stored code.
const MAGIC: &[u8; 8] = b"rtslcode";

/// An object file with the sizes of the stack frames of its functions.
#[derive(Debug, PartialEq, Eq)]
pub struct MadeCode {
    /// The object file (ELF).
    pub object: Vec<u8>,
    /// The frames, which may be too large.
    pub frames: Frames,
}

impl MadeCode {
    /// Loads the code.
    ///
    /// # Errors
    /// If a frame is too large, or the object is not one that the loader knows.
    pub fn load(&self) -> Result<Module, JitError> {
        self.frames.check()?;
        Module::load(&self.object, self.frames.clone())
    }

    /// Returns bytes to store for the module of a key: a digest of it and of what follows, the frames, the object.
    pub fn to_bytes(&self, key: ModuleKey) -> Vec<u8> {
        let mut content = Vec::with_capacity(self.object.len() + 256);
        let functions: Vec<(&str, usize)> = self.frames.iter().collect();
        content.extend((functions.len() as u32).to_le_bytes());
        for (name, bytes) in functions {
            content.extend((name.len() as u32).to_le_bytes());
            content.extend(name.as_bytes());
            content.extend((bytes as u64).to_le_bytes());
        }
        content.extend(&self.object);
        [&MAGIC[..], &digest(key, &content), &content].concat()
    }

    /// Returns the code that was stored for the module of a key; `None` if the bytes are not whole, or for another one.
    pub fn from_bytes(bytes: &[u8], key: ModuleKey) -> Option<MadeCode> {
        let bytes = bytes.strip_prefix(MAGIC)?;
        let (stored, content) = bytes.split_first_chunk::<{ blake3::OUT_LEN }>()?;
        if *stored != digest(key, content) {
            return None;
        }
        let mut rest = content;
        let mut frames = Frames::default();
        for _ in 0..u32::from_le_bytes(take(&mut rest)?) {
            let length = u32::from_le_bytes(take(&mut rest)?) as usize;
            let (name, after) = rest.split_at_checked(length)?;
            rest = after;
            let bytes = u64::from_le_bytes(take(&mut rest)?);
            frames.add(str::from_utf8(name).ok()?, usize::try_from(bytes).ok()?);
        }
        Object::parse(rest).ok()?;
        Some(MadeCode { object: rest.to_vec(), frames })
    }
}

fn digest(key: ModuleKey, content: &[u8]) -> [u8; blake3::OUT_LEN] {
    let mut hasher = blake3::Hasher::new_keyed(key.bytes());
    hasher.update(content);
    *hasher.finalize().as_bytes()
}

/// Takes bytes from the front.
fn take<const N: usize>(bytes: &mut &[u8]) -> Option<[u8; N]> {
    let (taken, rest) = bytes.split_first_chunk()?;
    *bytes = rest;
    Some(*taken)
}

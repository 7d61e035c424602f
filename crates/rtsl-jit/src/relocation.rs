//! The relocations of each supported machine.

use object::elf::{self, EM_AARCH64, EM_X86_64, Machine, RelocationType};

use crate::error::JitError;

/// The word that a relocation changes.
pub struct Place<'a> {
    /// The module's memory.
    pub memory: &'a mut [u8],
    /// The word's offset in it.
    pub offset: usize,
    /// The address at which the memory will run.
    pub base: u64,
}

/// The target of a relocation.
#[derive(Clone, Copy)]
pub struct Via {
    /// The address of the symbol, or of the stub that jumps to it.
    pub address: u64,
    /// The address of a pointer to the symbol, if there is a stub.
    pub pointer: Option<u64>,
}

/// The offset of the pointer in a stub.
pub const STUB_POINTER: u64 = 16;

/// Writes a jump through a pointer, and the pointer.
pub fn write_stub(machine: Machine, stub: &mut [u8], address: u64) -> Result<(), JitError> {
    match machine {
        // jmp [rip + 10]
        EM_X86_64 => stub[..6].copy_from_slice(&[0xff, 0x25, 10, 0, 0, 0]),
        // ldr x16, [pc, 16]; br x16
        EM_AARCH64 => {
            stub[..4].copy_from_slice(&0x5800_0090_u32.to_le_bytes());
            stub[4..8].copy_from_slice(&0xd61f_0200_u32.to_le_bytes());
        }
        _ => return Err(unknown(machine, elf::R_X86_64_NONE)),
    }
    stub[STUB_POINTER as usize..].copy_from_slice(&address.to_le_bytes());
    Ok(())
}

/// Applies one relocation.
pub fn apply(
    machine: Machine,
    kind: RelocationType,
    mut place: Place<'_>,
    via: Via,
    addend: i64,
) -> Result<(), JitError> {
    match machine {
        EM_X86_64 => x86_64(kind, &mut place, via, addend),
        EM_AARCH64 => aarch64(kind, &mut place, via, addend),
        _ => Err(unknown(machine, kind)),
    }
}

fn x86_64(
    kind: RelocationType,
    place: &mut Place<'_>,
    via: Via,
    addend: i64,
) -> Result<(), JitError> {
    let target = via.address.wrapping_add_signed(addend);
    match kind {
        elf::R_X86_64_64 => place.write(target.to_le_bytes()),
        elf::R_X86_64_PC64 => place.write(target.wrapping_sub(place.address()).to_le_bytes()),
        elf::R_X86_64_PC32 | elf::R_X86_64_PLT32 => {
            place.write_signed32(target.wrapping_sub(place.address()))
        }
        elf::R_X86_64_GOTPCREL | elf::R_X86_64_GOTPCRELX | elf::R_X86_64_REX_GOTPCRELX => {
            let pointer = via.pointer.ok_or_else(|| unknown(EM_X86_64, kind))?;
            place.write_signed32(pointer.wrapping_add_signed(addend).wrapping_sub(place.address()))
        }
        _ => Err(unknown(EM_X86_64, kind)),
    }
}

fn aarch64(
    kind: RelocationType,
    place: &mut Place<'_>,
    via: Via,
    addend: i64,
) -> Result<(), JitError> {
    let target = via.address.wrapping_add_signed(addend);
    let pointer = || via.pointer.ok_or_else(|| unknown(EM_AARCH64, kind));
    match kind {
        elf::R_AARCH64_ABS64 => place.write(target.to_le_bytes()),
        elf::R_AARCH64_PREL64 => place.write(target.wrapping_sub(place.address()).to_le_bytes()),
        elf::R_AARCH64_PREL32 => place.write_signed32(target.wrapping_sub(place.address())),
        elf::R_AARCH64_ADR_PREL_PG_HI21 => place.page_of(target),
        elf::R_AARCH64_ADR_GOT_PAGE => place.page_of(pointer()?),
        elf::R_AARCH64_ADD_ABS_LO12_NC | elf::R_AARCH64_LDST8_ABS_LO12_NC => {
            place.low_bits(target, 0)
        }
        elf::R_AARCH64_LDST16_ABS_LO12_NC => place.low_bits(target, 1),
        elf::R_AARCH64_LDST32_ABS_LO12_NC => place.low_bits(target, 2),
        elf::R_AARCH64_LDST64_ABS_LO12_NC => place.low_bits(target, 3),
        elf::R_AARCH64_LDST128_ABS_LO12_NC => place.low_bits(target, 4),
        elf::R_AARCH64_LD64_GOT_LO12_NC => place.low_bits(pointer()?, 3),
        elf::R_AARCH64_JUMP26 | elf::R_AARCH64_CALL26 => {
            let distance = target.wrapping_sub(place.address()).cast_signed() >> 2;
            if !(-(1 << 25)..1 << 25).contains(&distance) {
                return Err(out_of_range());
            }
            place.insert(distance.cast_unsigned() as u32 & 0x03ff_ffff)
        }
        _ => Err(unknown(EM_AARCH64, kind)),
    }
}

impl Place<'_> {
    fn address(&self) -> u64 {
        self.base.wrapping_add(self.offset as u64)
    }

    fn write<const N: usize>(&mut self, bytes: [u8; N]) -> Result<(), JitError> {
        let rest = self.memory.get_mut(self.offset..).and_then(|rest| rest.first_chunk_mut());
        *rest.ok_or_else(out_of_range)? = bytes;
        Ok(())
    }

    fn write_signed32(&mut self, value: u64) -> Result<(), JitError> {
        let value = i32::try_from(value.cast_signed()).map_err(|_| out_of_range())?;
        self.write(value.to_le_bytes())
    }

    /// Sets bits of an instruction, which are zero in the object file.
    fn insert(&mut self, bits: u32) -> Result<(), JitError> {
        let rest = self.memory.get(self.offset..).and_then(|rest| rest.first_chunk());
        let instruction = u32::from_le_bytes(*rest.ok_or_else(out_of_range)?);
        self.write((instruction | bits).to_le_bytes())
    }

    /// Inserts the distance in pages of 4 KiB, for `adrp`.
    fn page_of(&mut self, target: u64) -> Result<(), JitError> {
        let pages = ((target & !0xfff).wrapping_sub(self.address() & !0xfff)).cast_signed() >> 12;
        if !(-(1 << 20)..1 << 20).contains(&pages) {
            return Err(out_of_range());
        }
        let pages = pages.cast_unsigned() as u32;
        self.insert((pages & 3) << 29 | (pages >> 2 & 0x7_ffff) << 5)
    }

    /// Inserts the offset in a page, in units of `1 << shift` bytes.
    fn low_bits(&mut self, target: u64, shift: u32) -> Result<(), JitError> {
        self.insert(((target & 0xfff) as u32 >> shift) << 10)
    }
}

fn out_of_range() -> JitError {
    JitError::Object("a relocation does not reach its target".to_owned())
}

fn unknown(machine: Machine, kind: RelocationType) -> JitError {
    JitError::Object(format!("the unknown relocation {kind} of machine {machine}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn applied(machine: Machine, kind: RelocationType, word: u32, address: u64) -> u32 {
        let mut memory = [0; 16];
        memory[8..12].copy_from_slice(&word.to_le_bytes());
        let place = Place { memory: &mut memory, offset: 8, base: 0x10_0000 };
        apply(machine, kind, place, Via { address, pointer: None }, 0).unwrap();
        u32::from_le_bytes(*memory[8..].first_chunk().unwrap())
    }

    #[test]
    fn aarch64_instructions_get_their_fields() {
        // adrp x0, two pages on; ldr q0, [x0, 0x340]; bl 0x100 on; bl 8 back
        assert_eq!(
            applied(EM_AARCH64, elf::R_AARCH64_ADR_PREL_PG_HI21, 0x9000_0000, 0x10_2340),
            0xd000_0000
        );
        assert_eq!(
            applied(EM_AARCH64, elf::R_AARCH64_LDST128_ABS_LO12_NC, 0x3dc0_0000, 0x10_2340),
            0x3dc0_d000
        );
        assert_eq!(applied(EM_AARCH64, elf::R_AARCH64_CALL26, 0x9400_0000, 0x10_0108), 0x9400_0040);
        assert_eq!(applied(EM_AARCH64, elf::R_AARCH64_CALL26, 0x9400_0000, 0x10_0000), 0x97ff_fffe);
    }

    #[test]
    fn x86_distances_are_from_the_word() {
        assert_eq!(applied(EM_X86_64, elf::R_X86_64_PC32, 0, 0x10_0108), 0x100);
        assert_eq!(applied(EM_X86_64, elf::R_X86_64_PLT32, 0, 0x10_0000), -8_i32 as u32);
        let mut memory = [0; 8];
        let place = Place { memory: &mut memory, offset: 0, base: 0 };
        let far = Via { address: 1 << 40, pointer: None };
        assert!(apply(EM_X86_64, elf::R_X86_64_PC32, place, far, 0).is_err());
        let place = Place { memory: &mut memory, offset: 6, base: 0 };
        assert!(apply(EM_X86_64, elf::R_X86_64_PC32, place, far, 0).is_err());
    }
}

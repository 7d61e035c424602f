//! Elementary functions by themselves.

use super::Chunk;
use super::lanes::Floats;
use super::libraries::Function;
use super::math::{exp, log, pow, sin_cos};
use super::precision::Precision;
use crate::kernels::{Exp, InverseSqrt, Log, Pow, SinCos};
use crate::packet::Packet;

impl Chunk for Exp {
    const FUNCTION: Option<Function> = Some(Function::Exp);

    #[inline(always)]
    unsafe fn chunk<F: Floats, P: Precision>(packet: Packet) {
        // Safety: the race has these arrays, as the caller promises.
        unsafe { exp(F::load(packet.state(0))).store(packet.state(1)) }
    }
}

impl Chunk for Log {
    const FUNCTION: Option<Function> = Some(Function::Log);

    #[inline(always)]
    unsafe fn chunk<F: Floats, P: Precision>(packet: Packet) {
        // Safety: the caller's promise.
        unsafe { log(F::load(packet.state(0))).store(packet.state(1)) }
    }
}

impl Chunk for Pow {
    const FUNCTION: Option<Function> = Some(Function::Pow);

    #[inline(always)]
    unsafe fn chunk<F: Floats, P: Precision>(packet: Packet) {
        // Safety: the caller's promise.
        unsafe {
            pow(F::load(packet.state(0)), F::load(packet.state(1))).store(packet.state(2));
        }
    }
}

impl Chunk for SinCos {
    const FUNCTION: Option<Function> = Some(Function::SinCos);

    #[inline(always)]
    unsafe fn chunk<F: Floats, P: Precision>(packet: Packet) {
        // Safety: the caller's promise.
        unsafe {
            let (sine, cosine) = sin_cos(F::load(packet.state(0)));
            sine.store(packet.state(1));
            cosine.store(packet.scratch(0));
        }
    }
}

impl Chunk for InverseSqrt {
    #[inline(always)]
    unsafe fn chunk<F: Floats, P: Precision>(packet: Packet) {
        // Safety: the caller's promise.
        unsafe { P::inverse_sqrt(F::load(packet.state(0))).store(packet.state(1)) }
    }
}

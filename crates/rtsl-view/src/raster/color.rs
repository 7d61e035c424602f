//! Premultiplied colours, `0xAARRGGBB`.

pub fn channels(pixel: u32) -> [f32; 4] {
    pixel.to_be_bytes().map(f32::from)
}

pub fn packed(channels: [f32; 4]) -> u32 {
    u32::from_be_bytes(channels.map(|channel| (channel + 0.5) as u8))
}

/// Multiplies two colours, channel by channel.
pub fn modulated(one: u32, other: u32) -> u32 {
    match (one, other) {
        (u32::MAX, color) | (color, u32::MAX) => color,
        _ => {
            let (one, other) = (one.to_be_bytes(), other.to_be_bytes());
            let product = |channel: usize| {
                let product = u32::from(one[channel]) * u32::from(other[channel]) + 128;
                ((product + (product >> 8)) >> 8) as u8
            };
            u32::from_be_bytes([product(0), product(1), product(2), product(3)])
        }
    }
}

/// Puts a premultiplied colour over another.
pub fn blend(below: u32, above: u32) -> u32 {
    let rest = 255 - (above >> 24);
    // Two channels at a time, with room for their products, divided by 255 and rounded.
    let pair = |two: u32| {
        let product = two * rest + 0x0080_0080;
        ((product + ((product >> 8) & 0x00FF_00FF)) >> 8) & 0x00FF_00FF
    };
    let low = pair(below & 0x00FF_00FF) + (above & 0x00FF_00FF);
    let high = pair((below >> 8) & 0x00FF_00FF) + ((above >> 8) & 0x00FF_00FF);
    saturated(low) | saturated(high) << 8
}

/// Two channels, each at most 255: colours of additive blending exceed it.
pub fn saturated(pair: u32) -> u32 {
    let over = (pair >> 8) & 0x0001_0001;
    (pair | (over * 0xFF)) & 0x00FF_00FF
}

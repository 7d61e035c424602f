//! A made-up file of a measured material.

/// The type of floats and of bytes in such files.
const FLOAT: u8 = 10;
const BYTE: u8 = 1;

/// A paint that varies with the azimuth of the viewer if there are several.
pub fn paint(azimuths: usize) -> Vec<u8> {
    let angles = [0.0_f32, 0.7, 1.5];
    let azimuth = |index: usize| (index as f32 / 4.0 - 0.5) * std::f32::consts::TAU;
    let azimuths: Vec<f32> = (0..azimuths).map(azimuth).collect();
    let views = [azimuths.len(), angles.len()];
    let slices = azimuths.len() * angles.len();
    let waves = |count: usize, step: usize| -> Vec<f32> {
        (0..count).map(|index| 0.2 + (index * step % 11) as f32 / 20.0).collect()
    };
    let floats: [(&str, Vec<usize>, Vec<f32>); 8] = [
        ("theta_i", vec![angles.len()], angles.to_vec()),
        ("phi_i", vec![azimuths.len()], azimuths.clone()),
        ("ndf", vec![4, 5], waves(20, 3)),
        ("sigma", vec![3, 6], waves(18, 2)),
        ("vndf", [views.as_slice(), &[5, 6]].concat(), waves(slices * 30, 7)),
        ("luminance", [views.as_slice(), &[4, 4]].concat(), waves(slices * 16, 5)),
        ("wavelengths", vec![5], vec![400.0, 450.0, 550.0, 620.0, 700.0]),
        ("spectra", [views.as_slice(), &[5, 4, 4]].concat(), waves(slices * 80, 3)),
    ];
    let bytes = |numbers: &[f32]| numbers.iter().flat_map(|it| it.to_le_bytes()).collect();
    let floats = floats.iter().map(|(name, shape, it)| (*name, FLOAT, shape.clone(), bytes(it)));
    let mut fields: Vec<(&str, u8, Vec<usize>, Vec<u8>)> = floats.collect();
    fields.push(("description", BYTE, vec![5], b"paint".to_vec()));
    fields.push(("jacobian", BYTE, vec![1], vec![1]));
    tensors(&fields)
}

/// A file of these fields: name, type, sizes of dimensions, and data.
pub fn tensors(fields: &[(&str, u8, Vec<usize>, Vec<u8>)]) -> Vec<u8> {
    let mut head = b"tensor_file\0\x01\0".to_vec();
    head.extend((fields.len() as u32).to_le_bytes());
    let sizes = fields.iter().map(|(name, _, shape, _)| 13 + name.len() + 8 * shape.len());
    let mut place = head.len() + sizes.sum::<usize>();
    let mut data: Vec<u8> = Vec::new();
    for (name, kind, shape, bytes) in fields {
        head.extend((name.len() as u16).to_le_bytes());
        head.extend(name.as_bytes());
        head.extend((shape.len() as u16).to_le_bytes());
        head.push(*kind);
        head.extend((place as u64).to_le_bytes());
        for size in shape {
            head.extend((*size as u64).to_le_bytes());
        }
        place += bytes.len();
        data.extend(bytes);
    }
    head.extend(data);
    head
}

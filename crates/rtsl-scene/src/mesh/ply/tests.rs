use super::*;

/// A square of two triangles with all supported attributes, and some that are skipped.
const HEADER: &str = "element vertex 4\nproperty float x\nproperty double y\nproperty float z\n\
    property uchar red\nproperty list uchar short tags\nproperty float nx\nproperty float ny\n\
    property float nz\nproperty float s\nproperty float t\nelement edge 1\nproperty int a\n\
    element face 2\nproperty list uchar int vertex_indices\nproperty ushort flags\nend_header\n";

const TEXT: &str = "0 0 0 255 0 0 0 1 0 0\n1. 0 0 255 1 7 0 0 1 1 0\n 1 1 .0 255 0 0 0 1 1 1\r\n\
    0 1e0 0 255 2 -1 2 0 0 1 0 1\n9\n3 0 1 2 5\n4\t0 2 3 1 6";

fn text() -> Vec<u8> {
    format!("ply\nformat ascii 1.0\ncomment made by \u{e9}\n{HEADER}{TEXT}").into_bytes()
}

/// The same file in binary.
fn binary(big_endian: bool) -> Vec<u8> {
    let name = if big_endian { "big" } else { "little" };
    let mut file = format!("ply\r\nformat binary_{name}_endian 1.0\n{HEADER}").into_bytes();
    let mut push = |bytes: &mut [u8]| {
        if big_endian {
            bytes.reverse();
        }
        file.extend_from_slice(bytes);
    };
    for (position, tags) in [([0, 0], &[][..]), ([1, 0], &[7]), ([1, 1], &[]), ([0, 1], &[-1, 2])] {
        let [x, y] = position;
        push(&mut (x as f32).to_le_bytes());
        push(&mut f64::from(y).to_le_bytes());
        push(&mut 0_f32.to_le_bytes());
        push(&mut [255]);
        push(&mut [tags.len() as u8]);
        tags.iter().for_each(|tag: &i16| push(&mut tag.to_le_bytes()));
        for number in [0.0, 0.0, 1.0, x as f32, y as f32] {
            push(&mut number.to_le_bytes());
        }
    }
    push(&mut 9_i32.to_le_bytes());
    for (corners, flags) in [(&[0, 1, 2][..], 5_u16), (&[0, 2, 3, 1], 6)] {
        push(&mut [corners.len() as u8]);
        corners.iter().for_each(|corner: &i32| push(&mut corner.to_le_bytes()));
        push(&mut flags.to_le_bytes());
    }
    file
}

fn floats(numbers: &rtsl::Numbers) -> Vec<f32> {
    numbers.words().iter().map(|bits| f32::from_bits(*bits)).collect()
}

#[test]
fn text_and_both_byte_orders_give_the_same_mesh() {
    for file in [text(), binary(false), binary(true)] {
        let mesh = read_ply(&*file).unwrap();
        assert_eq!(floats(&mesh.positions), [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]);
        assert_eq!(floats(&mesh.normals), [0., 0., 1.].repeat(4));
        assert_eq!(floats(&mesh.uvs), [0., 0., 1., 0., 1., 1., 0., 1.]);
        assert_eq!(mesh.indices.words()[..], [0, 1, 2, 0, 2, 3, 0, 3, 1]);
    }
}

#[test]
fn every_file_that_was_cut_off_is_refused() {
    for file in [text(), binary(false)] {
        // The last number of the text may lose digits and still be valid.
        for length in 0..file.len() - 1 {
            assert!(read_ply(&file[..length]).is_err(), "{length} bytes");
        }
    }
}

fn problem(header: &str, numbers: &str) -> String {
    let file = format!("ply\nformat ascii 1.0\n{header}end_header\n{numbers}");
    read_ply(file.as_bytes()).expect_err("it is wrong").to_string()
}

#[test]
fn what_is_wrong_is_said() {
    let vertices = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    let faces = "element face 1\nproperty list uchar int vertex_indices\n";
    let corners = "0 0 0 1 0 0 0 1 0 ";
    let whole = |numbers: &str| problem(&format!("{vertices}{faces}"), numbers);
    assert_eq!(whole(""), "the file ends within its numbers");
    assert_eq!(whole("0 0 x"), "it has `x` where a number should be");
    assert_eq!(
        whole(&format!("{corners}3 0 1 3")),
        "a face has the corner 3, but there are 3 vertices"
    );
    assert_eq!(
        whole(&format!("{corners}3 0 1 -2")),
        "a face has the corner -1, but there are 3 vertices"
    );
    assert_eq!(
        whole("0 0 0 1 nan 0 0 1 0 3 0 1 2"),
        "vertex 1 has a coordinate that is not finite"
    );
    assert_eq!(whole(&format!("{corners}-1 0")), "it has a list of -1 numbers");
    assert_eq!(problem(vertices, corners), "it has no face");
    assert_eq!(
        problem("element vertex 1\nproperty float x\n", "1"),
        "its vertices lack `x`, `y` or `z`"
    );
    assert_eq!(problem("element face 1\nproperty int x\n", "1"), "its faces lack `vertex_indices`");
    assert_eq!(
        problem("element vertex many\n", ""),
        "its header has the line `element vertex many`"
    );
    assert_eq!(problem("property float x\n", ""), "its header has the line `property float x`");
    assert_eq!(
        problem("element tristrips 1\nproperty int x\n", "1"),
        "its strips lack `vertex_indices`"
    );
    let file = |text: &str| read_ply(text.as_bytes()).expect_err("it is wrong").to_string();
    assert_eq!(file("solid cube"), "the file ends within its header");
    assert_eq!(file("solid cube\n"), "it is not a PLY file");
    assert_eq!(file("ply\nend_header\n"), "its header has no line `format`");
    assert_eq!(file("ply\nformat gzip 1.0\n"), "its format is `gzip`");
    assert_eq!(file(&"x".repeat(1 << 17)), "its header has an endless line");
}

#[test]
fn what_a_header_claims_costs_nothing() {
    let many = usize::MAX;
    let vertex = "property float x\nproperty float y\nproperty float z\n";
    assert_eq!(
        problem(&format!("element vertex {many}\n{vertex}"), "1 2 3"),
        "it has more than 715827882 vertices"
    );
    assert_eq!(
        problem(&format!("element vertex 700000000\n{vertex}"), "1 2 3"),
        "the file ends within its numbers"
    );
    assert_eq!(problem(&format!("element nothing {many}\n"), ""), "it has no face");
    let faces = format!("element face {many}\nproperty list uint int vertex_indices\n");
    assert_eq!(problem(&faces, "4294967295 1 2"), "the file ends within its numbers");
}

#[test]
fn strips_are_triangles() {
    let vertices = "element vertex 5\nproperty float x\nproperty float y\nproperty float z\n";
    let header = "ply\nformat ascii 1.0\n";
    let strips = "element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
    let corners = "0 0 0 1 0 0 0 1 0 1 1 0 0 2 0 ";
    let file = format!("{header}{vertices}{strips}{corners}9 0 1 2 3 -1 2 3 3 4");
    let mesh = read_ply(file.as_bytes()).unwrap();
    assert_eq!(mesh.indices.words()[..], [0, 1, 2, 2, 1, 3]);
    let file = format!("{header}{vertices}{strips}{corners}5 0 1 2 3 4");
    let mesh = read_ply(file.as_bytes()).unwrap();
    assert_eq!(mesh.indices.words()[..], [0, 1, 2, 2, 1, 3, 2, 3, 4]);
}

//! Random numbers and vectors that are the same in every run.

/// A generator of numbers (splitmix64).
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
}

impl Random {
    /// The generator of this seed.
    pub fn new(seed: u64) -> Random {
        Random { state: seed }
    }

    fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.state ^ (self.state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// In [0,1).
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1 << 24) as f32
    }

    /// In [`from`, `to`).
    pub fn between(&mut self, from: f32, to: f32) -> f32 {
        from + (to - from) * self.unit()
    }

    /// Less than `count`, which is not 0.
    pub fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    /// True once in `count` times.
    pub fn one_in(&mut self, count: usize) -> bool {
        self.below(count) == 0
    }

    /// One of them.
    pub fn choose(&mut self, values: &[f32]) -> f32 {
        values[self.below(values.len())]
    }

    /// In the ball of this radius around the origin.
    pub fn in_ball(&mut self, radius: f32) -> Vector {
        loop {
            let point = Vector([(); 3].map(|()| self.between(-1.0, 1.0)));
            let square = point.dot(point);
            if (1e-6..1.0).contains(&square) {
                return point.times(radius);
            }
        }
    }

    /// Any direction, unit length.
    pub fn direction(&mut self) -> Vector {
        self.in_ball(1.0).normalized()
    }
}

/// Three floats.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vector(pub [f32; 3]);

impl Vector {
    /// Componentwise.
    pub fn plus(self, other: Vector) -> Vector {
        Vector(std::array::from_fn(|index| self.0[index] + other.0[index]))
    }

    /// Each component times `factor`.
    pub fn times(self, factor: f32) -> Vector {
        Vector(self.0.map(|component| factor * component))
    }

    /// The scalar product.
    pub fn dot(self, other: Vector) -> f32 {
        let products = self.0.iter().zip(other.0).map(|(a, b)| a * b);
        products.sum()
    }

    /// The vector product.
    pub fn cross(self, other: Vector) -> Vector {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Vector([b * z - c * y, c * x - a * z, a * y - b * x])
    }

    /// The same direction, unit length.
    pub fn normalized(self) -> Vector {
        self.times(self.dot(self).sqrt().recip())
    }

    /// Returns the vector mirrored if necessary, so that it is on the side of `normal`.
    pub fn on_side_of(self, normal: Vector) -> Vector {
        if self.dot(normal) < 0.0 { self.times(-1.0) } else { self }
    }
}

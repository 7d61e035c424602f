//! The six roles and their methods.

/// The part of a ray tracer that a shader implements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Role {
    /// Generates rays.
    Camera,
    /// Intersects rays with geometry.
    Primitive,
    /// Returns colours and numbers over surfaces and space.
    Texture,
    /// Illuminates points.
    Light,
    /// Scatters and emits light at a surface.
    Material,
    /// Gathers the light that a camera's ray brings back.
    Integrator,
}

impl Role {
    /// All roles: those of the paper of 2007 in its order, then integrators.
    pub const ALL: [Role; 6] = [
        Role::Camera,
        Role::Primitive,
        Role::Texture,
        Role::Light,
        Role::Material,
        Role::Integrator,
    ];

    /// The name in diagnostics: `camera`.
    pub const fn name(self) -> &'static str {
        match self {
            Role::Camera => "camera",
            Role::Primitive => "primitive",
            Role::Texture => "texture",
            Role::Light => "light",
            Role::Material => "material",
            Role::Integrator => "integrator",
        }
    }

    /// The name of the base class: `rt_Camera`.
    pub const fn class(self) -> &'static str {
        match self {
            Role::Camera => "rt_Camera",
            Role::Primitive => "rt_Primitive",
            Role::Texture => "rt_Texture",
            Role::Light => "rt_Light",
            Role::Material => "rt_Material",
            Role::Integrator => "rt_Integrator",
        }
    }

    /// A bit set of roles; the bit index is the position in [`Role::ALL`].
    pub fn bits(roles: &[Role]) -> u32 {
        let bits = Role::ALL.iter().zip(0..).filter(|(role, _)| roles.contains(role));
        bits.fold(0, |bits, (_, position)| bits | 1 << position)
    }

    /// The role whose base class is `name`.
    pub fn from_class(name: &str) -> Option<Role> {
        Role::ALL.into_iter().find(|role| role.class() == name)
    }

    /// The interface methods of this role, without `constructor`.
    pub fn methods(self) -> impl Iterator<Item = Method> {
        Method::ALL.into_iter().filter(move |method| method.roles().contains(&self))
    }
}

/// The interface methods that hosts call. `constructor` belongs to every role and is not listed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs, reason = "each is documented by `Method::doc`")]
pub enum Method {
    GenerateRay,
    Intersect,
    ComputeBounds,
    ComputeNormal,
    ComputeTextureCoordinates,
    ComputeDerivatives,
    GenerateSample,
    SamplePdf,
    Lookup,
    Shade,
    Bsdf,
    SampleBsdf,
    EvaluatePdf,
    Emission,
    Illumination,
    Radiance,
    Presence,
}

impl Method {
    /// All methods, grouped by role.
    pub const ALL: [Method; 17] = [
        Method::GenerateRay,
        Method::Intersect,
        Method::ComputeBounds,
        Method::ComputeNormal,
        Method::ComputeTextureCoordinates,
        Method::ComputeDerivatives,
        Method::GenerateSample,
        Method::SamplePdf,
        Method::Lookup,
        Method::Shade,
        Method::Bsdf,
        Method::SampleBsdf,
        Method::EvaluatePdf,
        Method::Emission,
        Method::Illumination,
        Method::Radiance,
        Method::Presence,
    ];

    /// The name in RTSL source.
    pub const fn name(self) -> &'static str {
        match self {
            Method::GenerateRay => "generateRay",
            Method::Intersect => "intersect",
            Method::ComputeBounds => "computeBounds",
            Method::ComputeNormal => "computeNormal",
            Method::ComputeTextureCoordinates => "computeTextureCoordinates",
            Method::ComputeDerivatives => "computeDerivatives",
            Method::GenerateSample => "generateSample",
            Method::SamplePdf => "samplePDF",
            Method::Lookup => "lookup",
            Method::Shade => "shade",
            Method::Bsdf => "BSDF",
            Method::SampleBsdf => "sampleBSDF",
            Method::EvaluatePdf => "evaluatePDF",
            Method::Emission => "emission",
            Method::Illumination => "illumination",
            Method::Radiance => "radiance",
            Method::Presence => "presence",
        }
    }

    /// The method called `name` in RTSL source.
    pub fn from_name(name: &str) -> Option<Method> {
        Method::ALL.into_iter().find(|method| method.name() == name)
    }

    /// The roles that have the method. Materials and lights share `evaluatePDF` and `emission`.
    pub const fn roles(self) -> &'static [Role] {
        match self {
            Method::GenerateRay => &[Role::Camera],
            Method::Intersect
            | Method::ComputeBounds
            | Method::ComputeNormal
            | Method::ComputeTextureCoordinates
            | Method::ComputeDerivatives
            | Method::GenerateSample
            | Method::SamplePdf => &[Role::Primitive],
            Method::Lookup => &[Role::Texture],
            Method::Shade | Method::Bsdf | Method::SampleBsdf | Method::Presence => {
                &[Role::Material]
            }
            Method::EvaluatePdf | Method::Emission => &[Role::Material, Role::Light],
            Method::Illumination => &[Role::Light],
            Method::Radiance => &[Role::Integrator],
        }
    }

    /// True if a host receives what the method writes to scratch: of primitives only what `intersect` leaves. Later
    /// methods change scratch for themselves.
    pub fn leaves_scratch(self) -> bool {
        self == Method::Intersect || self.roles() != [Role::Primitive]
    }

    /// A description of the method in one sentence.
    pub const fn doc(self) -> &'static str {
        match self {
            Method::GenerateRay => "generates the ray for a position on the image and the lens",
            Method::Intersect => "offers the ray's hits to `hit()`",
            Method::ComputeBounds => "gives an axis-aligned box around the primitive",
            Method::ComputeNormal => "gives the normals at the hit point",
            Method::ComputeTextureCoordinates => "gives the texture coordinates of the hit point",
            Method::ComputeDerivatives => "gives the surface's and the coordinates' derivatives",
            Method::GenerateSample => {
                "chooses a point on the primitive, seen from a point to be lit"
            }
            Method::SamplePdf => "gives the density with which `generateSample` chooses a point",
            Method::Lookup => "gives the texture's value",
            Method::Shade => "gives the radiance that returns to the ray",
            Method::Bsdf => "gives the scattering function for one pair of directions",
            Method::SampleBsdf => "chooses a direction of scattered light",
            Method::EvaluatePdf => "gives the density with which a direction is chosen",
            Method::Emission => "gives the radiance emitted towards the ray's origin",
            Method::Illumination => "gives the light that arrives at a point",
            Method::Radiance => "gives the radiance along a ray",
            Method::Presence => {
                "gives what part of the surface there is; rays pass where there is none"
            }
        }
    }
}

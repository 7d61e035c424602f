//! Nodes of colours: adjustments and compositing.

/// The rows.
pub const ROWS: &[&str] = &[
    "remap | T | in=0 inlow=0 inhigh=1 outlow=0 outhigh=1 | \
     mxColor.remapped({in}, {inlow}, {inhigh}, {outlow}, {outhigh})",
    "smoothstep | T | in=0 low=0 high=1 | mxColor.smoothed({in}, {low}, {high})",
    "luminance | T | in=0 lumacoeffs:color3=0.2722287,0.6740818,0.0536895 | mxColor.grey({in}, {lumacoeffs})",
    "rgbtohsv | T | in=0 | mxColor.rgbToHsv({in})",
    "hsvtorgb | T | in=0 | mxColor.hsvToRgb({in})",
    "contrast | T | in=0 amount=1 pivot=0.5 | mxColor.contrasted({in}, {amount}, {pivot})",
    "range | T | in=0 inlow=0 inhigh=1 gamma=1 outlow=0 outhigh=1 doclamp:boolean=false | \
     mxColor.ranged({in}, {inlow}, {inhigh}, {gamma}, {outlow}, {outhigh}, {doclamp})",
    "hsvadjust | T | in=0 amount:vector3=0,1,1 | mxColor.hsvAdjusted({in}, {amount})",
    "saturate | T | in=0 amount:float=1 lumacoeffs:color3=0.2722287,0.6740818,0.0536895 | \
     mxColor.saturated({in}, {amount}, {lumacoeffs})",
    "colorcorrect | T | in=1 hue:float=0 saturation:float=1 gamma:float=1 lift:float=0 gain:float=1 contrast:float=1 \
     contrastpivot:float=0.5 exposure:float=0 | mxColor.corrected({in}, {hue}, {saturation}, {gamma}, {lift}, {gain}, \
     {contrast}, {contrastpivot}, {exposure})",
    "premult | color4 | in=0,0,0,1 | vec4({in}.rgb * {in}.a, {in}.a)",
    "unpremult | color4 | in=0,0,0,1 | mxColor.unpremultiplied({in})",
    "plus | T | fg=0 bg=0 mix:float=1 | mix({bg}, {bg} + {fg}, {mix})",
    "minus | T | fg=0 bg=0 mix:float=1 | mix({bg}, {bg} - {fg}, {mix})",
    "difference | T | fg=0 bg=0 mix:float=1 | mix({bg}, abs({bg} - {fg}), {mix})",
    "burn | T | fg=0 bg=0 mix:float=1 | mxColor.burnt({fg}, {bg}, {mix})",
    "dodge | T | fg=0 bg=0 mix:float=1 | mxColor.dodged({fg}, {bg}, {mix})",
    "screen | T | fg=0 bg=0 mix:float=1 | mix({bg}, 1.0 - (1.0 - {fg}) * (1.0 - {bg}), {mix})",
    "overlay | T | fg=0 bg=0 mix:float=1 | mxColor.overlaid({fg}, {bg}, {mix})",
    "disjointover | color4 | fg=0 bg=0 mix:float=1 | mxColor.disjoint({fg}, {bg}, {mix})",
    "in | color4 | fg=0 bg=0 mix:float=1 | mix({bg}, {fg} * {bg}.a, {mix})",
    "mask | color4 | fg=0 bg=0 mix:float=1 | mix({bg}, {bg} * {fg}.a, {mix})",
    "matte | color4 | fg=0 bg=0 mix:float=1 | mxColor.matted({fg}, {bg}, {mix})",
    "out | color4 | fg=0 bg=0 mix:float=1 | mix({bg}, {fg} * (1.0 - {bg}.a), {mix})",
    "over | color4 | fg=0 bg=0 mix:float=1 | mix({bg}, {fg} + {bg} * (1.0 - {fg}.a), {mix})",
    "inside | T | in=0 mask:float=1 | {in} * {mask}",
    "outside | T | in=0 mask:float=0 | {in} * (1.0 - {mask})",
    "mix | T | fg=0 bg=0 mix=0 | mix({bg}, {fg}, {mix})",
    "srgb_texture_to_lin_rec709 | T | in=0 | mxColor.linearOfSrgb({in})",
    "rec709_display_to_lin_rec709 | T | in=0 | mxColor.linearOfGamma({in}, 2.4)",
    "g18_rec709_to_lin_rec709 | T | in=0 | mxColor.linearOfGamma({in}, 1.8)",
    "g22_rec709_to_lin_rec709 | T | in=0 | mxColor.linearOfGamma({in}, 2.2)",
    "gooch_shade | color3 | warm_color=0.8,0.8,0.7 cool_color=0.3,0.3,0.8 specular_intensity:float=1 shininess:float=64 \
     light_direction:vector3=1,-0.5,-0.5 | mxColor.gooch({warm_color}, {cool_color}, {specular_intensity}, {shininess}, \
     {light_direction}, rt_ShadingNormal, normalize(rt_RayDirection))",
    "deon_hair_absorption_from_melanin | vector3 | melanin_concentration:float=0.25 melanin_redness:float=0.5 \
     eumelanin_color:color3=0.657704,0.498077,0.254107 pheomelanin_color:color3=0.829444,0.67032,0.349938 | \
     mxHair.absorptionOfMelanin({melanin_concentration}, {melanin_redness}, {eumelanin_color}, {pheomelanin_color})",
    "chiang_hair_absorption_from_color | vector3 | color:color3=1 azimuthal_roughness:float=0.2 | \
     mxHair.absorptionOfColor({color}, {azimuthal_roughness})",
];

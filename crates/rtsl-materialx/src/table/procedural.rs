//! Nodes of patterns: ramps, noises and shapes.

/// The rows.
pub const ROWS: &[&str] = &[
    "ramplr | T | valuel=0 valuer=0 texcoord:vector2=@UV0 | mix({valuel}, {valuer}, clamp({texcoord}.x, 0.0, 1.0))",
    "ramptb | T | valuet=0 valueb=0 texcoord:vector2=@UV0 | mix({valueb}, {valuet}, clamp({texcoord}.y, 0.0, 1.0))",
    "ramp4 | T | valuetl=0 valuetr=0 valuebl=0 valuebr=0 texcoord:vector2=@UV0 | \
     mix(mix({valuebl}, {valuebr}, clamp({texcoord}.x, 0.0, 1.0)), \
     mix({valuetl}, {valuetr}, clamp({texcoord}.x, 0.0, 1.0)), clamp({texcoord}.y, 0.0, 1.0))",
    "splitlr | T | valuel=0 valuer=0 center:float=0.5 texcoord:vector2=@UV0 | \
     mix({valuel}, {valuer}, mxShapes.edge({center}, {texcoord}.x, rt_du))",
    "splittb | T | valuet=0 valueb=0 center:float=0.5 texcoord:vector2=@UV0 | \
     mix({valueb}, {valuet}, mxShapes.edge({center}, {texcoord}.y, rt_dv))",
    "noise2d | T | amplitude=1 pivot:float=0 texcoord:vector2=@UV0 | \
     mxNoise.perlin{S}({texcoord}) * {amplitude} + {pivot}",
    "noise3d | T | amplitude=1 pivot:float=0 position:vector3=@Pobject | \
     mxNoise.perlin{S}({position}) * {amplitude} + {pivot}",
    "fractal2d | T | amplitude=1 octaves:integer=3 lacunarity:float=2 diminish:float=0.5 texcoord:vector2=@UV0 | \
     mxNoise.fractal{S}({texcoord}, {octaves}, {lacunarity}, {diminish}) * {amplitude}",
    "fractal3d | T | amplitude=1 octaves:integer=3 lacunarity:float=2 diminish:float=0.5 position:vector3=@Pobject | \
     mxNoise.fractal{S}({position}, {octaves}, {lacunarity}, {diminish}) * {amplitude}",
    "cellnoise2d | float | texcoord:vector2=@UV0 | mxNoise.cell({texcoord})",
    "cellnoise3d | float | position:vector3=@Pobject | mxNoise.cell({position})",
    "worleynoise2d | T | texcoord:vector2=@UV0 jitter:float=1 style:integer=0 | \
     mxNoise.worley{S}({texcoord}, {jitter}, {style})",
    "worleynoise3d | T | position:vector3=@Pobject jitter:float=1 style:integer=0 | \
     mxNoise.worley{S}({position}, {jitter}, {style})",
    "unifiednoise2d | float | texcoord:vector2=@UV0 freq:vector2=1 offset:vector2=0 jitter:float=1 outmin:float=0 \
     outmax:float=1 clampoutput:boolean=true octaves:integer=3 lacunarity:float=2 diminish:float=0.5 type:integer=0 \
     style:integer=0 | mxNoise.unified({texcoord}, {freq}, {offset}, {jitter}, {outmin}, {outmax}, {clampoutput}, \
     {octaves}, {lacunarity}, {diminish}, {type}, {style})",
    "unifiednoise3d | float | position:vector3=@Pobject freq:vector3=1 offset:vector3=0 jitter:float=1 outmin:float=0 \
     outmax:float=1 clampoutput:boolean=true octaves:integer=3 lacunarity:float=2 diminish:float=0.5 type:integer=0 \
     style:integer=0 | mxNoise.unified({position}, {freq}, {offset}, {jitter}, {outmin}, {outmax}, {clampoutput}, \
     {octaves}, {lacunarity}, {diminish}, {type}, {style})",
    "checkerboard | color3 | color1=1 color2=0 uvtiling:vector2=8 uvoffset:vector2=0 texcoord:vector2=@UV0 | \
     mxShapes.checkers(mxShapes.tiled({texcoord}, {uvtiling}, {uvoffset}), {color1}, {color2})",
    "line | float | texcoord:vector2=@UV0 center:vector2=0 radius=0.1 point1:vector2=0.25 point2:vector2=0.75 | \
     mxShapes.segment({texcoord}, {center}, {radius}, {point1}, {point2})",
    "circle | float | texcoord:vector2=@UV0 center:vector2=0 radius=0.5 | mxShapes.disk({texcoord}, {center}, {radius})",
    "cloverleaf | float | texcoord:vector2=@UV0 center:vector2=0 radius=0.5 | \
     mxShapes.cloverleaf({texcoord}, {center}, {radius})",
    "hexagon | float | texcoord:vector2=@UV0 center:vector2=0 radius=0.5 | \
     mxShapes.hexagon({texcoord}, {center}, {radius})",
    "grid | color3 | texcoord:vector2=@UV0 uvtiling:vector2=1 uvoffset:vector2=0 thickness:float=0.05 \
     staggered:boolean=false | mxShapes.grid(mxShapes.tiled({texcoord}, {uvtiling}, {uvoffset}), {thickness}, \
     {staggered})",
    "crosshatch | color3 | texcoord:vector2=@UV0 uvtiling:vector2=1 uvoffset:vector2=0 thickness:float=0.05 \
     staggered:boolean=false | mxShapes.crosshatch(mxShapes.tiled({texcoord}, {uvtiling}, {uvoffset}), {thickness}, \
     {staggered})",
    "tiledcircles | color3 | texcoord:vector2=@UV0 uvtiling:vector2=1 uvoffset:vector2=0 size:float=0.5 \
     staggered:boolean=false | mxShapes.disks(mxShapes.tiled({texcoord}, {uvtiling}, {uvoffset}), {size}, {staggered})",
    "tiledcloverleafs | color3 | texcoord:vector2=@UV0 uvtiling:vector2=1 uvoffset:vector2=0 size:float=0.5 \
     staggered:boolean=false | mxShapes.cloverleafs(mxShapes.tiled({texcoord}, {uvtiling}, {uvoffset}), {size}, \
     {staggered})",
    "tiledhexagons | color3 | texcoord:vector2=@UV0 uvtiling:vector2=1 uvoffset:vector2=0 size:float=0.5 \
     staggered:boolean=false | mxShapes.hexagons(mxShapes.tiled({texcoord}, {uvtiling}, {uvoffset}), {size}, \
     {staggered})",
    "randomcolor | color3 | in:*=0 huelow:float=0 huehigh:float=1 saturationlow:float=0.825 saturationhigh:float=1 \
     brightnesslow:float=1 brightnesshigh:float=1 seed:integer=0 | mxColor.hsvToRgb(mxNoise.randomHsv(4096.0 * float({in}), {seed}, \
     vec2({huelow}, {huehigh}), vec2({saturationlow}, {saturationhigh}), vec2({brightnesslow}, {brightnesshigh})))",
];

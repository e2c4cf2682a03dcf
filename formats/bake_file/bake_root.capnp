@0xd3a1c7e5b9f2046b;
# bake_root.capnp: schema of the root of a bake file. bake_format.md documents the fields.
#
# Minor versions may append fields but never change the meaning of one.

struct BakeRoot {
  seed @0 :UInt64;
  photons @1 :UInt64;
  sources @2 :UInt64;
  rouletteKappa @3 :Float64;
  longestPathS @4 :Float64;
  temperatureC @5 :Float64;
  humidityPercent @6 :Float64;
  pressureKpa @7 :Float64;

  tool @8 :Text;
  level @9 :Text;
  arguments @10 :List(Text);
  libraries @11 :List(Text);
  inputs @12 :List(InputFile);
  inputHash @13 :UInt64;

  photonsTraced @14 :UInt64;
  bounces @15 :UInt64;
  photonsEscaped @16 :UInt64;
  rooms @17 :UInt32;
  deposits @18 :UInt64;
  meanFreePathM @19 :Float64;
  powerEmitted @20 :List(Float32);
  powerEscaped @21 :List(Float32);
  powerUnfinished @22 :List(Float32);
  decayPlaces @23 :UInt32;
  decayT30S @24 :List(Float32);
  decayT30ErrorS @25 :List(Float32);
  decayErrorDb @26 :Float32;
  warnings @27 :List(Text);

  bandsHz @28 :List(Float32);
  materials @29 :List(Material);
  emitters @30 :List(Emitter);
  signals @31 :List(Signal);
  geometry @32 :Geometry;

  trees @33 :List(Tree);                # instanced trees first, the level's last
  signalMaps @34 :List(List(UInt32));   # per map: replacement of each signal

  emitterInstances @35 :List(EmitterInstance); # runs of emitters not listed in emitters
  emitterNames @36 :Data;               # names of those, as a zstd frame
  emitterNamesBytes @37 :UInt64;

  probes @38 :Probes;                   # since 3.2
  movables @39 :List(Movable);          # since 3.2
  portals @40 :Portals;                 # since 3.2

  earlyOrder @41 :UInt8;                # since 3.2
  images @42 :List(Image);              # since 3.2

  findings @43 :Findings;               # since 3.2
  powerArrived @44 :List(List(Float32)); # since 3.2
}

struct Findings {
  closedness @0 :Text;                  # whether and where sound leaves the level
  thinGaps @1 :UInt32;                  # number, of which the largest are listed
  list @2 :List(Finding);
  escapedShare @3 :Float64;             # of the emitted power, through openings
}

struct Finding {
  kind @0 :UInt8;                       # 0 an opening, 1 a thin gap
  text @1 :Text;
  hasPlace @2 :Bool;
  placeM @3 :List(Float64);             # x, y, z in the world
  sizeM @4 :Float64;                    # width of an opening, length of a gap
  direction @5 :List(Float64);          # mean of the escaping sound, x, y, z
}

struct Image {
  emitter @0 :UInt32;                   # virtual ones have no images
  x @1 :Float64;
  y @2 :Float64;
  z @3 :Float64;
  axisX @4 :Float32;
  axisY @5 :Float32;
  axisZ @6 :Float32;
}

struct Portals {
  portals @0 :List(Portal);
  sets @1 :List(List(UInt16));          # per set: its portals, ascending, then 0x3fff or 0x7fff: the
                                        # open or closed state; the first set is empty
  emitters @2 :List(UInt32);            # per virtual emitter: its emitter
  emitterSets @3 :List(UInt16);         # and its set
}

struct Portal {
  name @0 :Text;
  centreM @1 :List(Float64);            # x, y, z
  halfUM @2 :List(Float64);
  halfVM @3 :List(Float64);
  bakedClosed @4 :Bool;                 # the level is also baked with it as a surface
  parts @5 :List(UInt16);               # indices of the movables that open and close it
}

struct Probes {
  places @0 :List(Probe);
  zones @1 :List(Tree);     # late reflections; not among BakeRoot.trees
}

struct Movable {
  name @0 :Text;
  x @1 :Float64;                        # of the pivot, at rest
  y @2 :Float64;
  z @3 :Float64;
  rotationX @4 :Float32;
  rotationY @5 :Float32;
  rotationZ @6 :Float32;
  rotationW @7 :Float32;
  scale @8 :Float32;
  vertices @9 :List(Float32);           # x, y, z each, relative to the pivot
  triangles @10 :List(UInt32);          # three indices of vertices each
  materials @11 :List(UInt16);          # per triangle
}

struct Probe {
  x @0 :Float64;
  y @1 :Float64;
  z @2 :Float64;
  tree @3 :Tree;            # early reflections; not among BakeRoot.trees
  zone @4 :UInt32;
}

struct Tree {
  top @0 :Data;             # entry of the root, 120 bytes, as in a page
  levels @1 :List(Level);   # of the pages of this tree, from its root
}

struct Level {
  nodes @0 :UInt64;
  sources @1 :UInt64;
  packedBytes @2 :UInt64;
  power @3 :List(Float32);  # per band, of these sources
}

struct InputFile {
  name @0 :Text;
  bytes @1 :UInt64;
  hash @2 :UInt64;
}

struct Material {
  name @0 :Text;
  absorption @1 :List(Float32);
  scattering @2 :List(Float32);
  phong @3 :List(Float32);
  transmission @4 :List(Float32);
  rowsM @5 :Float32;                    # since 3.2
}

# A material without rows. Files whose materials are all without have these, which readers of
# Material take as such.
struct PlainMaterial {
  name @0 :Text;
  absorption @1 :List(Float32);
  scattering @2 :List(Float32);
  phong @3 :List(Float32);
  transmission @4 :List(Float32);
}

struct Emitter {
  name @0 :Text;
  x @1 :Float64;
  y @2 :Float64;
  z @3 :Float64;
  axisX @4 :Float64;
  axisY @5 :Float64;
  axisZ @6 :Float64;
  gain @7 :Float64;
  directivity @8 :List(Float32);
  signal @9 :UInt32;
  delayS @10 :Float64;
}

struct EmitterInstance {
  at @0 :UInt32;            # indices in the table
  from @1 :UInt32;
  count @2 :UInt32;
  signals @3 :UInt32;       # index of a signal map, 2^32 - 1: none
  offsetX @4 :Float64;
  offsetY @5 :Float64;
  offsetZ @6 :Float64;
  rotationX @7 :Float32;
  rotationY @8 :Float32;
  rotationZ @9 :Float32;
  rotationW @10 :Float32;
  scale @11 :Float32;
  gain @12 :Float32;
  delayS @13 :Float64;
}

struct Signal {
  name @0 :Text;
  loop @1 :Bool;
  scale @2 :Float32;
  frames @3 :UInt64;
  blockOffset @4 :List(UInt64);        # block*: one element per block
  blockBytes @5 :List(UInt32);
  blockHash @6 :List(UInt64);
  meanSquare @7 :List(Float32);
  envelopeOffset @8 :UInt64;
  envelopeBytes @9 :UInt32;
  envelopeHash @10 :UInt64;
}

struct Geometry {
  lowX @0 :Float64;
  lowY @1 :Float64;
  lowZ @2 :Float64;
  vertices @3 :UInt32;
  triangles @4 :UInt32;
  offset @5 :UInt64;
  bytes @6 :UInt64;
  hash @7 :UInt64;
  pages @8 :List(GeometryPage);  # since 3.1; vertices to bytes are then 0
}

struct GeometryPage {
  offset @0 :UInt64;
  hash @1 :UInt64;
  bytes @2 :UInt32;
  vertices @3 :UInt32;
  triangles @4 :UInt32;
}

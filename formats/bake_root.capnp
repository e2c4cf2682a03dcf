@0xd3a1c7e5b9f2046b;
# bake_root.capnp: the root of a bake file, read in place. bake_format.md says what the fields mean.
#
# Lists named node* and page* are columns: entry i, or a fixed number of entries per i, belongs to
# node i. Minor versions may add fields at the end; they never change the meaning of one.

struct BakeRoot {
  seed @0 :UInt64;
  photons @1 :UInt64;
  rouletteKappa @2 :Float64;
  longestPathS @3 :Float64;
  temperatureC @4 :Float64;
  humidityPercent @5 :Float64;
  pressureKpa @6 :Float64;

  tool @7 :Text;
  level @8 :Text;
  inputHash @9 :UInt64;

  photonsTraced @10 :UInt64;
  bounces @11 :UInt64;
  photonsEscaped @12 :UInt64;
  meanFreePathM @13 :Float64;
  powerEmitted @14 :List(Float32);
  powerEscaped @15 :List(Float32);
  powerUnfinished @16 :List(Float32);
  warnings @17 :List(Text);

  bandsHz @18 :List(Float32);
  materials @19 :List(Material);
  emitters @20 :List(Emitter);
  signals @21 :List(Signal);
  geometry @22 :Geometry;

  nodeLow @23 :List(Float32);          # 3 per node
  nodeHigh @24 :List(Float32);         # 3 per node
  nodeHighestKey @25 :List(Float32);
  nodePower @26 :List(Float32);        # 8 per node
  nodeCone @27 :List(Float32);         # 4 per node: axis, cosine of half angle
  nodeDelay @28 :List(Float32);        # 2 per node: least, most
  nodeChildren @29 :List(UInt32);      # 8 per node, 0xffffffff where there is none

  pageOffset @30 :List(UInt64);
  pagePacked @31 :List(UInt32);
  pageSources @32 :List(UInt32);
  pageHash @33 :List(UInt64);

  # since 1.1
  sources @34 :UInt64;
  rooms @35 :UInt32;
  deposits @36 :UInt64;
  arguments @37 :List(Text);

  # since 1.2
  libraries @38 :List(Text);
  inputs @39 :List(InputFile);
  decayPlaces @40 :UInt32;
  decayT30S @41 :List(Float32);
  decayT30ErrorS @42 :List(Float32);
  decayErrorDb @43 :Float32;
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

struct Signal {
  name @0 :Text;
  loop @1 :Bool;
  scale @2 :Float32;
  frames @3 :UInt64;
  offset @4 :UInt64;
  bytes @5 :UInt64;
  hash @6 :UInt64;
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
}

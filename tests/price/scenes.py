"""The scenes of tools/price: commands that users know, cut to a second or less.

Commands run in a folder of their own, where `clamor` is the program, `price_scenes` calls the libraries
(price_scenes.cpp), `levels` are those of assets and `shared` those beside the repository. Callgrind
counts all instructions of `clamor`, and of `price_scenes` those of what the scene is named after: 50
keyframes are a second of sound. Valgrind takes 20 to 150 times as long, most where there are rays, so
most bakes have few sources.
"""

BAKE = "--no-journal --quiet --threads 1"
SPEAKER = "--emitter name=speaker,signal=noise,at=0,1.5,0"

# Bakes that scenes play, made before anything is counted.
INPUTS = {
    "violin.clamor": f"clamor bake levels/violin_room.glb -o violin.clamor --photons 1000 --sources 3000 --early-order 0 {BAKE}",
    "violin_1e5.clamor": f"clamor bake levels/violin_room.glb -o violin_1e5.clamor --photons 20000 --sources 100000 --early-order 0 {BAKE}",
    "images.clamor": f"clamor bake levels/violin_room.glb -o images.clamor --photons 150 --sources 300 {BAKE}",
    "few.clamor": f"clamor bake levels/violin_room.glb -o few.clamor --photons 150 --sources 300 --early-order 0 {BAKE}",
    "stadium.clamor": f"clamor bake levels/stadium.glb -o stadium.clamor --photons 17000 --sources 20000 {BAKE}",
    "sponza.clamor": f"clamor bake shared/sponza.glb -o sponza.clamor --photons 500 --sources 3000 --early-order 0 {SPEAKER} {BAKE}",
    "city.clamor": "price_scenes city city.clamor",
}

SCENES = {
    "bake_violin": f"clamor bake levels/violin_room.glb -o bake_violin.clamor --photons 1000 --sources 5000 {BAKE}",
    "bake_sponza": f"clamor bake shared/sponza.glb -o bake_sponza.clamor --photons 200 --sources 2000 {SPEAKER} {BAKE}",
    "import_sponza": "price_scenes import shared/sponza.glb",
    "render_violin_stand": "price_scenes render violin.clamor 0,1.7,3 0 10",
    "render_violin_walk": "price_scenes render violin.clamor -1.5,1.7,3 1.5 5",
    "render_violin_all": "clamor render images.clamor -o render_violin_all.wav --strategy all --listener 0,1.7,3 --seconds 0.05",
    "render_sponza_walk": "price_scenes render sponza.clamor -6,1.7,1 1.5 5",
    "render_stadium_walk": "price_scenes render stadium.clamor 0,1.7,-20 1.5 5",
    "keyframes_1e5": "price_scenes keyframes violin_1e5.clamor -1.5,1.7,3 1.5 5",
    "keyframes_1e7": "price_scenes keyframes city.clamor 700,2,700 1.5 10",
    "first_listener": "price_scenes listener few.clamor",
    "impulse": "clamor impulse images.clamor -o impulse.wav --listener 2,1.7,-3",
    "report": "clamor report few.clamor -o report.html --listener 0,1.7,3",
}

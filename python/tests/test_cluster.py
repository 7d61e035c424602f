"""Renders on clusters of Ray: three processes on this machine."""

import itertools
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import rtsl
from rtsl import _rtsl
from rtsl.cluster import _bundle, _schedule, _worker

ray = pytest.importorskip("ray", reason="there is no Ray for this interpreter")
pytestmark = [
    pytest.mark.skipif(sys.platform == "win32", reason="processes are killed by signals"),
    # Ray's own.
    pytest.mark.filterwarnings("ignore::FutureWarning", "ignore::DeprecationWarning", "ignore::ResourceWarning"),
]

#: The command of this version, if there is a build of it.
COMMAND = os.environ.get("RTSL_PROGRAM", "")
needs_command = pytest.mark.skipif(not os.path.exists(COMMAND), reason="RTSL_PROGRAM names no `rtsl`")

SCENE = """Film "rgb" "integer xresolution" 60 "integer yresolution" 44
Sampler "sobol" "integer pixelsamples" 40
Integrator "path" "integer maxdepth" 3
LookAt 0 1 -5  0 0 0  0 1 0
Camera "Pinhole"
WorldBegin
LightSource "infinite" "rgb L" [0.5 0.6 0.7]
Shape "Sphere" "string name" "ball"
Texture "tiles" "spectrum" "Checker" "float scale" 3
Material "diffuse" "texture reflectance" "tiles"
Shape "Plane" "point3 point" [0 -1 0] "string name" "floor"
"""
AOVS = ["distance", "object", "normal", "samples", "variance", "nodes"]


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """A cluster of three processes, whose files are in a folder of its own; returns its address."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RTSL_CLUSTER_CACHE", str(tmp_path_factory.mktemp("cache")))
        patch.setenv("RAY_ENABLE_UV_RUN_RUNTIME_ENV", "0")
        started = ray.init(
            address="local", num_cpus=3, include_dashboard=False, log_to_driver=False, logging_level="error",
            object_store_memory=100 << 20,
        )
        yield started.address_info["gcs_address"]
        ray.shutdown()


@pytest.fixture()
def scene(tmp_path):
    path = tmp_path / "scene.pbrt"
    path.write_text(SCENE)
    return path


def on_cluster(scene, **keywords):
    # One process, which prepares the scene once; `threads=1` is for three.
    return rtsl.cluster.render(scene, **{"threads": 3, "task_seconds": 0.3, **keywords})


def assert_same(one, other):
    assert np.array_equal(one.pixels, other.pixels)
    assert sorted(one.aovs) == sorted(other.aovs)
    for name in one.aovs:
        assert np.array_equal(one[name], other[name], equal_nan=True), name


def test_pictures_have_the_bits_of_one_process(cluster, scene):
    expected = rtsl.Scene.load(scene).render(aovs=AOVS)
    image = on_cluster(scene, aovs=AOVS, threads=1)
    assert_same(image, expected)
    assert image.statistics["rays"] == expected.statistics["rays"]
    assert image.statistics["tasks"] > 5 and image.statistics["processes"] <= 3
    # The noise of tiles decides where they end, whoever renders them.
    noisy = dict(spp=96, noise=0.03, aovs=["samples"])
    expected = rtsl.Scene.load(scene).render(**noisy)
    assert len(np.unique(expected["samples"])) > 1
    assert_same(on_cluster(scene, **noisy), expected)


def test_parameters_and_settings_are_sent(cluster, scene):
    loaded = rtsl.Scene.load(scene, defines={"ball.radius": 1.2}, integrator="Normals")
    loaded["floor"].point = (0, -1.3, 0)
    loaded.settings = {"spp": 3}
    keywords = dict(size=(33, 20), seed=0)
    assert_same(on_cluster(loaded, **keywords), loaded.render(**keywords))
    loaded.add(rtsl.library.Sphere())
    with pytest.raises(rtsl.SceneError, match="parts were added"):
        on_cluster(loaded)
    with pytest.raises(rtsl.SceneError, match="scenes of files"):
        on_cluster(rtsl.Scene(rtsl.library.Pinhole()))
    with pytest.raises(TypeError, match="takes no `camera`"):
        on_cluster(loaded, camera="0")
    with pytest.raises(rtsl.SceneError, match="no node of the cluster has 4 processors"):
        on_cluster(scene, threads=4)


def test_values_that_are_not_finite_are_counted_once(cluster, tmp_path):
    (tmp_path / "broken.rtsl").write_text(
        "class Broken : rt_Texture; public float x = -1.0; void lookup() { rt_TextureColor = color(log(x)); }"
    )
    text = SCENE.replace('"Checker" "float scale" 3', '"Broken"')
    (tmp_path / "scene.pbrt").write_text(text)
    keywords = dict(spp=2, size=(24, 16))
    expected = rtsl.Scene.load(tmp_path / "scene.pbrt").render(**keywords)
    count = expected.statistics["dropped_samples"]
    assert count > 0
    with pytest.warns(rtsl.SceneWarning, match=f"`BSDF` of `Lambertian` returned {count} values"):
        image = on_cluster(tmp_path / "scene.pbrt", **keywords)
    assert image.statistics["dropped_samples"] == count


def workers():
    """The processes of the cluster that run a task."""
    listed = subprocess.run(["ps", "-eo", "pid,ppid,args"], capture_output=True, text=True, check=True).stdout
    processes = [line.split(None, 2) for line in listed.splitlines()[1:]]
    parents = {int(pid): int(parent) for pid, parent, *_ in processes}

    def is_ours(pid):
        while pid in parents and pid != os.getpid():
            pid = parents[pid]
        return pid == os.getpid()

    tasks = [int(it[0]) for it in processes if len(it) == 3 and it[2].startswith("ray::task")]
    return [pid for pid in tasks if is_ours(pid)]


def test_killed_processes_change_nothing(cluster, scene):
    loaded = rtsl.Scene.load(scene)
    keywords = dict(spp=2400, aovs=AOVS)
    expected = loaded.render(**keywords)
    chosen, killed, ended = random.Random(5), [], threading.Event()

    def kill():
        while len(killed) < 20 and not ended.is_set():
            running = workers()
            if running:
                pid = chosen.choice(running)
                os.kill(pid, signal.SIGKILL)
                killed.append(pid)
            ended.wait(chosen.uniform(0.05, 0.3))

    killer = threading.Thread(target=kill)
    killer.start()
    try:
        image = on_cluster(loaded, threads=1, **keywords)
    finally:
        ended.set()
        killer.join()
    assert len(killed) == 20
    assert_same(image, expected)
    assert image.statistics["rays"] == expected.statistics["rays"]


HEAD = """
import rtsl, sys
rtsl.cluster.render(sys.argv[1], spp=4000, address=sys.argv[2], threads=3, task_seconds=0.3,
                    checkpoint=sys.argv[3], checkpoint_every=0.1)
"""


def test_a_killed_head_goes_on_from_its_checkpoint(cluster, scene, tmp_path):
    checkpoint = tmp_path / "kept.checkpoint"
    head = subprocess.Popen([sys.executable, "-c", HEAD, str(scene), cluster, str(checkpoint)])
    for _ in range(600):
        if checkpoint.exists():
            break
        time.sleep(0.05)
    time.sleep(0.3)
    head.kill()
    head.wait()
    begun = rtsl.Scene.load(scene).begin(spp=4000, aovs=["samples"])
    assert begun.resume(checkpoint)
    taken = begun.image()["samples"]
    assert 0 < taken.mean() < 4000
    # What is left is short, and no tile has more samples already.
    samples = int(taken.max()) + 100
    image = on_cluster(scene, spp=samples, checkpoint=checkpoint)
    expected = rtsl.Scene.load(scene).render(spp=samples)
    assert_same(image, expected)
    assert image.statistics["rays"] < expected.statistics["rays"]
    # The checkpoint is now that of the whole picture, which no task needs to make again.
    assert on_cluster(scene, spp=samples, checkpoint=checkpoint).statistics["tasks"] == 0
    other = tmp_path / "other.pbrt"
    other.write_text(SCENE + 'Shape "Sphere"\n')
    with pytest.raises(rtsl.SceneError, match="belongs to another render"):
        on_cluster(other, spp=samples, checkpoint=checkpoint)


def test_time_and_callbacks_end_renders(cluster, scene, monkeypatch):
    monkeypatch.setattr("rtsl.cluster._head._PICTURE_EVERY", 0.1)
    seen = []
    image = on_cluster(scene, spp=100_000, callback=lambda image: seen.append(image) or len(seen) < 3)
    assert len(seen) == 3 and seen[0].pixels.shape == (44, 60, 3)
    assert 0 < image.statistics["samples"] < 100_000
    begun = time.monotonic()
    image = on_cluster(scene, spp=100_001, seconds=1)
    assert time.monotonic() - begun < 10 and image.statistics["samples"] < 100_001
    # What runs still is cancelled, so that the cluster is free again.
    begun = time.monotonic()
    on_cluster(scene, spp=1)
    assert time.monotonic() - begun < 10


def many_files(folder):
    """A scene of many files in two folders; returns its path and the number of different files."""
    (folder / "parts").mkdir()
    (folder / "shaders").mkdir()
    picture = rtsl.Scene.load(folder / "scene.pbrt").render(spp=1, size=(16, 16))
    picture.save(folder / "absolute.png")
    shutil.copy(folder / "absolute.png", folder / "parts" / "same.png")
    (folder / "parts" / "triangle.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n-1 0 0\n1 0 0\n0 1 -1\n3 0 1 2\n"
    )
    (folder / "parts" / "more.pbrt").write_text(
        'AttributeBegin\nTexture "same" "spectrum" "imagemap" "string filename" "parts/same.png"\n'
        'Material "diffuse" "texture reflectance" "same"\n'
        'Shape "plymesh" "string filename" "parts/triangle.ply"\nAttributeEnd\n'
    )
    (folder / "shaders" / "tone.rtsl").write_text("color tone(float x) { return color(x, 0.5 * x, 0.2); }\n")
    (folder / "stripes.rtsl").write_text(
        '#include "tone.rtsl"\nclass Stripes : rt_Texture;\n'
        "void lookup() { rt_TextureColor = tone(fract(9.0 * rt_TextureUV.x)); }\n"
    )
    path = folder / "parts" / ".." / "whole.pbrt"
    path.write_text(
        SCENE.replace('"Checker" "float scale" 3', '"Stripes"')
        + f'Texture "far" "spectrum" "imagemap" "string filename" "{folder}/absolute.png"\n'
        + 'Material "diffuse" "texture reflectance" "far"\nTranslate 1 0 0\nShape "Sphere"\nInclude "parts/more.pbrt"\n'
    )
    return path, len(["whole", "more", "triangle", "absolute and same", "stripes", "tone"])


def test_files_are_sent_once_by_digest(cluster, scene, tmp_path, monkeypatch):
    path, count = many_files(tmp_path)
    loading = dict(search_path=[tmp_path / "shaders"])
    expected = rtsl.Scene.load(path, **loading).render(spp=4)
    image = on_cluster(path, spp=4, **loading)
    assert_same(image, expected)
    figures = image.statistics
    assert (figures["sent_files"], figures["fetched_files"]) == (count, count), figures
    # Another render of the scene sends nothing, though processes prepare it anew.
    image = on_cluster(path, spp=5, **loading)
    assert (image.statistics["sent_files"], image.statistics["fetched_files"]) == (0, 0)
    # Nor does it need the files in their places.
    (tmp_path / "shaders" / "tone.rtsl").write_text("color tone(float x) { return color(0.3, x, x); }\n")
    changed = on_cluster(path, spp=4, **loading)
    assert (changed.statistics["sent_files"], changed.statistics["fetched_files"]) == (1, 1)
    assert_same(changed, rtsl.Scene.load(path, **loading).render(spp=4))
    assert not np.array_equal(changed.pixels, expected.pixels)
    # A file that the disk has damaged is sent again.
    digest, _ = _rtsl.file_digest(str(tmp_path / "absolute.png"))
    damaged = pathlib.Path(os.environ["RTSL_CLUSTER_CACHE"]) / digest
    damaged.write_bytes(damaged.read_bytes()[::-1])
    image = on_cluster(path, spp=6, **loading)
    assert (image.statistics["sent_files"], image.statistics["fetched_files"]) == (1, 1)


def test_files_that_are_not_used_give_room(tmp_path, monkeypatch):
    cache = _bundle.FileCache(str(tmp_path / "cache"))
    sent = []
    for name in ("old", "middle", "new"):
        (tmp_path / name).write_bytes(name.encode() * 1000)
        sent.append(_bundle.SentFile(name, *_rtsl.file_digest(str(tmp_path / name))))
    for age, file in zip((9000, 8000, 10), sent):
        cache.add(file, (tmp_path / file.path).read_bytes())
        os.utime(cache.place(file.digest), (time.time() - age,) * 2)
    monkeypatch.setenv("RTSL_CLUSTER_CACHE_GIB", str(9500 / 2**30))
    cache.trim()
    assert [it.path for it in cache.missing(sent)] == ["old"]
    with pytest.raises(rtsl.SceneError, match="`old` has changed while"):
        cache.add(sent[0], b"other contents")
    assert sorted(os.listdir(cache.folder)) == sorted(it.digest for it in sent[1:])


def test_wrong_sums_are_refused(scene, tmp_path):
    def begun(text=SCENE, **keywords):
        scene.write_text(text)
        return rtsl.Scene.load(scene).begin(**{"spp": 4, **keywords})

    first = begun()
    first.render((0, 4), (3, 9))
    sums = first.sums((3, 9))
    again = begun()
    again.restore(sums, (3, 9))
    assert (again.taken((3, 9)), again.taken((3, 10)), again.sums((3, 9))) == (None, 0, sums)
    again.clear((4, 9))
    assert (again.taken((3, 4)), again.taken((3, 9))) == (None, 0)
    version = rtsl.__version__.encode()
    stated = sums[:-32].replace(version, b"9" * len(version))
    (tmp_path / "other version").write_bytes(stated)
    other_version = stated + bytes.fromhex(_rtsl.file_digest(str(tmp_path / "other version"))[0])
    for render, wrong, tiles, reason in [
        (begun(), sums, (4, 10), "tiles"),
        (begun(spp=4, seed=7), sums, (3, 9), "seed"),
        (begun(noise=0.1), sums, (3, 9), "noise target"),
        (begun(aovs=["distance"]), sums, (3, 9), "first hits"),
        (begun(SCENE + 'Shape "Sphere"\n'), sums, (3, 9), "a file of the scene has changed"),
        (begun(), other_version, (3, 9), "version of the program"),
        (begun(), sums[:-1], (3, 9), "truncated"),
        (begun(), sums[:200] + b"\x00" + sums[201:], (3, 9), "checksum|malformed|bytes"),
        (begun(), b"", (3, 9), "not a checkpoint"),
        (begun(), sums, (3, 9999), "does not have these tiles"),
    ]:
        with pytest.raises(rtsl.SceneError, match=reason):
            render.restore(wrong, tiles)
        assert render.taken() == 0, reason


def test_nodes_of_another_version_are_refused():
    with pytest.raises(rtsl.Error, match="has version .* of the package `rtsl`, and the head version 99.0.0"):
        _worker.task("", "99.0.0", [], [], (0, 1), (0, 1), None, 1)


def test_errors_of_scenes_are_those_of_one_machine(cluster, tmp_path):
    (tmp_path / "endless.rtsl").write_text(
        "class Endless : rt_Texture;\n"
        "void lookup() { float x = 1.0; while (x > 0.0) x += 1.0; rt_TextureColor = color(x); }\n"
    )
    path = tmp_path / "scene.pbrt"
    path.write_text(SCENE.replace('"Checker" "float scale" 3', '"Endless"'))
    with pytest.raises(rtsl.SceneError, match="E0619"):
        on_cluster(path)
    path.write_text("Sphere")
    with pytest.raises(rtsl.SceneError, match="E0604"):
        on_cluster(path)


def test_schedules_render_each_sample_once():
    for slots, tiles, samples, seconds in itertools.product((1, 3, 40), (1, 7, 500), (1, 16, 100), (0.001, 3.0)):
        schedule = _schedule.Schedule(samples, slots, 1.0)
        for range_ in schedule.ranges(tiles):
            schedule.add(range_, 0)
        taken, running, chosen = [0] * tiles, [], random.Random(3)
        while schedule.chains:
            while len(running) < 2 * slots and (work := schedule.next()):
                running.append(work)
            work = running.pop(chosen.randrange(len(running)))
            if chosen.random() < 0.1:
                schedule.again(work)
                continue
            first, end = work.samples
            assert first % 16 == 0 and first < end <= samples
            for tile in range(*work.chain.tiles):
                assert taken[tile] == first
                taken[tile] = end
            schedule.ended(work, None if end == samples else end, seconds)
        assert taken == [samples] * tiles and not running and schedule.share == 1.0


@needs_command
def test_checkpoints_are_those_of_the_command(cluster, scene, tmp_path, monkeypatch):
    monkeypatch.setattr("rtsl.cluster._head._PICTURE_EVERY", 0.0)

    def command(*arguments):
        return subprocess.run([COMMAND, "render", *map(str, arguments)], capture_output=True, text=True)

    checkpoint, whole = tmp_path / "kept", tmp_path / "whole.exr"
    options = ["--spp", 320, "--aov", ",".join(AOVS), "-D", "ball.radius=1.1"]
    assert command(scene, "-o", whole, *options).returncode == 0
    # The command begins, and the cluster goes on.
    begun = [scene, "-o", tmp_path / "a.exr", *options, "--checkpoint", checkpoint, "--time", 0.05]
    ended = command(*begun)
    assert "--resume" in ended.stderr, ended.stderr
    keywords = dict(spp=320, aovs=AOVS, defines={"ball.radius": "1.1"})
    image = on_cluster(scene, checkpoint=checkpoint, **keywords)
    image.save(tmp_path / "a.exr")
    assert (tmp_path / "a.exr").read_bytes() == whole.read_bytes()
    # The cluster begins, and the command goes on.
    checkpoint.unlink()
    image = on_cluster(scene, checkpoint=checkpoint, callback=lambda image: False, **keywords)
    assert 0 < image.statistics["samples"] < 320
    assert command(*begun[:-2], "--resume").returncode == 0
    assert (tmp_path / "a.exr").read_bytes() == whole.read_bytes()


@needs_command
def test_the_command_renders_on_clusters(cluster, scene, tmp_path, monkeypatch):
    monkeypatch.setenv("RTSL_PYTHON", sys.executable)
    options = ["--size", "50x30", "--aov", "distance,normal", "-D", "ball.radius=1.1", "--exr", "half", "--seed", "3"]

    def command(output, *others):
        arguments = [COMMAND, "render", str(scene), "-o", str(tmp_path / output), *options, *others]
        return subprocess.run(arguments, capture_output=True, text=True)

    assert command("one.exr").returncode == 0
    done = command("many.exr", "--cluster", cluster, "--stats", str(tmp_path / "stats.json"), "--threads", "3")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "many.exr").read_bytes() == (tmp_path / "one.exr").read_bytes()
    assert '"samples_per_pixel": 40' in (tmp_path / "stats.json").read_text()
    wrong = command("many.exr", "--cluster", "127.0.0.1:1")
    assert wrong.returncode == 1 and "no cluster of Ray at `127.0.0.1:1`" in wrong.stderr

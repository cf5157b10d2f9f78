# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Random deformations: never a fold, the same for every worker, pulled back by their inverse."""

from __future__ import annotations

import json
import pickle
from typing import Any

import numpy as np
import pytest

import tetwarp as tw
from tetwarp import augmentation as aug

FAMILIES = [
    aug.Elastic((1, 50), (15, 60)),
    aug.ElasticAffine(),
    aug.Breathing((3, 30)),
    aug.Swelling((15, 60), (-0.9, 2.5)),
    aug.Simulated((5, 25)),
]


def scene(space="LPS"):
    """A smooth image and labels on a grid that leans against the axes."""
    turned = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]])
    grid = tw.Geometry((44, 40, 30), spacing=(3, 3.5, 5), origin=(20, -60, 10), direction=turned)
    k, j, i = np.meshgrid(*(np.arange(n, dtype=np.float32) for n in grid.shape), indexing="ij")
    image = 1000 * np.exp(-(((i - 22) / 7) ** 2 + ((j - 20) / 7) ** 2 + ((k - 15) / 5) ** 2))
    return tw.Volume(image.astype(np.float32), grid), tw.Volume((image > 100).astype(np.uint8) + (image > 500), grid)


@pytest.mark.parametrize("family", FAMILIES, ids=lambda one: type(one).__name__)
def test_no_family_folds_and_certificates_say_what_came_of_it(family):
    image, labels = scene()
    for seed in range(8):
        warp = aug.draw(family, image.geometry, seed=seed)
        done = warp.deform(image, labels=[labels])
        certificate = json.loads(json.dumps(done.certificate))
        assert certificate["inverted"] == certificate["degenerate"] == 0 < certificate["jacobian"][0]
        if isinstance(family, aug.Elastic):
            assert certificate["shrunk"] == 0
        assert set(np.unique(done.labels[0].array)) <= {0, 1, 2}
        count = (done.labels[0].array == 2).sum() * 3 * 3.5 * 5 / 1000
        assert certificate["labels"][0]["2"][1] == pytest.approx(count)
        again = aug.Warp.of_record(certificate).deform(image, labels=[labels])
        assert np.array_equal(again.images[0].array, done.images[0].array)
        assert np.array_equal(again.labels[0].array, done.labels[0].array)


def test_what_follows_from_the_image_is_in_the_record():
    image, labels = scene()
    warp = aug.draw(aug.Simulated(displacement=12), image.geometry, seed=2, cell_size=4)
    with pytest.raises(tw.InputError, match="follows from the image"):
        warp.field()
    with pytest.raises(tw.InputError, match="another grid"):
        warp.deform(tw.Volume(image.array[1:].copy(), tw.Geometry((44, 40, 29), spacing=(3, 3.5, 5))))
    done = warp.deform(image)
    # Other tissue gives another field; the record gives the first one's, whatever it deforms.
    stiff = tw.Volume(np.full_like(image.array, 1000), image.geometry)
    assert not np.array_equal(warp.deform(stiff).warp.held.displacement, done.warp.held.displacement)
    again = aug.Warp.of_record(json.loads(json.dumps(done.certificate)))
    assert np.array_equal(again.held.displacement, done.warp.held.displacement)
    assert np.array_equal(again.deform(labels).images[0].array, done.warp.deform(labels).images[0].array)
    assert np.abs(done.warp.held.displacement).max() > 5
    record = done.certificate | {"field": done.certificate["field"] | {"displacement": "AAAA"}}
    with pytest.raises(tw.InputError, match="no record"):
        aug.Warp.of_record(record)


def test_elastic_fields_at_the_bound_never_fold_and_far_beyond_it_they_do():
    folded = 0
    for seed in range(40):
        random = np.random.default_rng(seed)
        angle = random.uniform(0, 3)
        turned = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        grid = tw.Geometry((30, 30, 24), spacing=random.uniform(0.7, 3, 3), direction=turned)
        cell, spacing = int(random.integers(1, 6)), float(random.uniform(4, 30))
        most = aug.never_folding_amplitude(grid, spacing, cell)
        for amplitude in (most, 30 * most):
            field = tw.fields.elastic(grid, amplitude=amplitude, spacing=spacing, seed=seed, cell_size=cell)
            warp = tw.Resampler(grid, backend="cpu")
            warp.set_field(field, outside="background")
            report = warp.resample([], maps=["coverage"])[2]
            if amplitude == most:
                assert report.inverted == report.degenerate == 0
            folded += report.inverted > 0
    assert folded > 10


def test_cells_whose_edges_change_by_less_than_the_bound_never_fold():
    # never_folding_amplitude rests on this: neighbours differ by less than h / 3 in each component, whatever the signs.
    grid = tw.Geometry((13, 13, 13), spacing=(2, 2, 2))
    random = np.random.default_rng(1)
    inverted = []
    for share in (0.99, 2.0):
        for _ in range(20):
            moved = random.integers(0, 2, (13, 13, 13, 3)) * np.float32(share * 2 / 3)
            warp = tw.Resampler(grid, backend="cpu")
            warp.set_field(tw.VertexField(grid, moved.astype(np.float32)), outside="background")
            inverted.append(warp.resample([], maps=["coverage"])[2].inverted)
    assert sum(inverted[:20]) == 0 < sum(inverted[20:])


def test_what_folds_is_shrunk_and_counted():
    image, labels = scene()
    warp = aug.draw(aug.Elastic(80, 25, may_fold=True), image.geometry, seed=3)
    certificate = warp.deform(image, labels=[labels]).certificate
    assert certificate["shrunk"] > 0 and certificate["share"] == pytest.approx(0.8 ** certificate["shrunk"])
    assert certificate["inverted"] == 0
    done = warp.deform(image, backgrounds=[0])
    wrong, right = (np.abs(one.undo(done.images[0], background=0).array - image.array).mean() for one in (warp, done.warp))
    assert right < 0.3 * wrong


@pytest.mark.parametrize("family", FAMILIES[1:3], ids=lambda one: type(one).__name__)
def test_undo_brings_back_what_was_there(family):
    image, _ = scene()
    for seed in range(3):
        warp = aug.draw(family, image.geometry, seed=seed)
        moved = warp.deform(image, backgrounds=[0]).images[0]
        back = warp.undo(moved, background=0)
        before, after = (np.abs(one.array - image.array).mean() for one in (moved, back))
        assert after < 0.1 * before


def test_ranges_and_words_that_do_not_fit_are_refused():
    image, _ = scene()
    with pytest.raises(tw.InputError, match="smaller"):
        aug.draw(aug.Elastic((5, 1)), image.geometry, seed=1)
    with pytest.raises(tw.InputError, match="nothing to deform"):
        aug.draw(aug.Elastic(), image.geometry, seed=1).deform()
    with pytest.raises(tw.InputError, match="no less than 0"):
        aug.draw(aug.Elastic(-5), image.geometry, seed=1)
    with pytest.raises(tw.InputError, match="expected a number, or"):
        aug.draw(aug.Elastic((1, 2, 3)), image.geometry, seed=1)
    record = aug.draw(aug.Elastic(), image.geometry, seed=1).record()
    for wrong, words in (({**record, "family": "Nope"}, "no family 'Nope'"), ({"family": "Elastic"}, "no record")):
        with pytest.raises(tw.InputError, match=words):
            aug.Warp.of_record(wrong)
    with pytest.raises(tw.InputError, match="named by a ndarray"):
        aug.seed_of(0, 0, np.zeros(3))


def test_a_family_of_ones_own_is_known_by_its_name():
    class Shift(aug.Family):
        def draw(self, random, geometry, cell_size):
            return {"by": random.uniform(1, 3)}

        @staticmethod
        def field(parameters, geometry, cell_size):
            return tw.fields.translate(geometry, by=(0, 0, parameters["by"]), cell_size=cell_size)

    image, _ = scene()
    done = aug.draw(Shift(), image.geometry, seed=1).deform(image)
    assert done.certificate["family"] == "Shift" and done.certificate["jacobian"] == [1, 1]


def test_what_reaches_beyond_the_first_image_is_deformed_as_well():
    image, _ = scene()
    large = tw.Geometry((120, 100, 70), image.geometry.spacing, image.geometry.point([-40, -30, -20]), image.geometry.direction)
    labels = tw.Volume(np.ones(large.shape, np.uint8), large)
    for family in (aug.Elastic(3, 40), aug.ElasticAffine(angle=3, shift=2), aug.Swelling(30, 0.5)):
        done = aug.draw(family, image.geometry, seed=2).deform(image, labels=[labels])
        before, after = done.certificate["labels"][0]["1"]
        assert 0.8 * before < after <= before
        back = done.warp.undo(done.labels[0], interpolation="vote", background=0)
        assert (back.array == 1).mean() > 0.8
        # The first image is deformed as it is without the other.
        alone = aug.draw(family, image.geometry, seed=2).deform(image)
        assert np.abs(alone.images[0].array - done.images[0].array).max() < 1


def test_a_seed_depends_on_all_three():
    seeds = {aug.seed_of(s, e, k) for s in (1, 2) for e in (0, 1) for k in ("a", "b")}
    assert len(seeds) == 8


# --- MONAI


def monai_sample(**more):
    torch = pytest.importorskip("torch")
    pytest.importorskip("monai")
    from monai.data import MetaTensor

    image, labels = scene()
    affine = torch.as_tensor(image.geometry.affine("RAS"))

    def tensor(*volumes):
        return MetaTensor(torch.stack([torch.as_tensor(v.array).permute(2, 1, 0).contiguous() for v in volumes]), affine=affine)

    other = tw.Volume(image.array * 2, image.geometry)
    return {"image": tensor(image, other), "label": tensor(labels), **more}


def monai_transform(**options):
    from tetwarp.monai import RandTetwarpd

    return RandTetwarpd(["image", "label"], aug.ElasticAffine(), labels=["label"], **{"prob": 1.0, "background": 0, **options})


def test_monai_deforms_all_keys_by_one_field():
    sample = monai_sample()
    image, labels = scene()
    transform = monai_transform()
    transform.set_random_state(3)
    done = transform(sample)
    assert len(done["image"].applied_operations) == 1
    certificate = json.loads(done["tetwarp_certificate"])
    expected = aug.Warp.of_record(certificate).deform(image, labels=[labels], backgrounds=[0])
    assert np.array_equal(done["image"][0].numpy(), expected.images[0].array.transpose(2, 1, 0))
    assert np.array_equal(done["label"][0].numpy(), expected.labels[0].array.transpose(2, 1, 0))
    assert np.allclose(done["image"][1].numpy(), 2 * done["image"][0].numpy(), atol=1e-3)
    assert done["image"].affine.equal(sample["image"].affine) and done["label"].dtype == sample["label"].dtype
    back = transform.inverse(done)
    before, after = ((one["image"] - sample["image"]).abs().mean() for one in (done, back))
    assert after < 0.1 * before
    assert not back["image"].applied_operations
    still = monai_transform(prob=0.0)
    untouched = still(sample)
    assert untouched["tetwarp_certificate"] == "" and (untouched["image"] == sample["image"]).all()
    assert (still.inverse(untouched)["image"] == sample["image"]).all()


def test_monai_applies_what_is_pending_first():
    sample = monai_sample()
    from monai.transforms import Flipd

    eager, lazy = Flipd(["image", "label"], 0), Flipd(["image", "label"], 0, lazy=True)
    results = []
    for flip in (eager, lazy):
        transform = monai_transform(seed=5, seed_key="name")
        results.append(transform(flip({**sample, "name": "a"})))
    assert not results[1]["image"].pending_operations
    assert (results[0]["image"] - results[1]["image"]).abs().max() < 0.5  # the lazy flip interpolates


@pytest.mark.parametrize("start", ["fork", "spawn"])
def test_monai_gives_the_same_in_any_worker_and_order(start):
    sample = monai_sample()
    from torch.utils.data import DataLoader

    transform = pickle.loads(pickle.dumps(monai_transform(seed=7, seed_key="name")))
    data = Samples([{**sample, "name": name} for name in "abcd"], transform)
    alone = [data[n]["image"] for n in range(4)]
    loader = DataLoader(data, batch_size=None, num_workers=2, multiprocessing_context=start)
    for n, one in enumerate(loader):
        assert (one["image"] == alone[n]).all()
    assert (data[2]["image"] == alone[2]).all()
    assert not (alone[0] == alone[1]).all()
    transform.epoch = 1
    assert not (data[2]["image"] == alone[2]).all()
    with pytest.raises(tw.InputError, match="seed_key"):
        transform(sample)


def test_workers_that_stay_see_the_epoch():
    sample = monai_sample(name="a")
    from torch.utils.data import DataLoader

    transform = monai_transform(seed=7, seed_key="name")
    loader = DataLoader(Samples([sample], transform), batch_size=None, num_workers=1, persistent_workers=True)
    seen = []
    for transform.epoch in (0, 1):
        seen += [one["image"] for one in loader]
    assert not (seen[0] == seen[1]).all()


@pytest.mark.parametrize("options", [{}, {"seed": 3, "seed_key": "name"}])
def test_monai_makes_batches_and_inverts_predictions(options):
    sample = monai_sample()
    from monai.data import DataLoader
    from monai.transforms import Compose, Invertd

    transform = Compose([monai_transform(**{**options, "prob": 0.5})])
    samples = [{**sample, "name": name} for name in "abcdef"]
    samples[1]["label"] = samples[1]["label"] * 0
    certificates = []
    for batch in DataLoader(Samples(samples, transform), batch_size=3):
        assert batch["image"].shape == (3, 2, 44, 40, 30)
        certificates += batch["tetwarp_certificate"]
    assert len(certificates) == 6 and any(certificates)
    assert all(json.loads(one)["inverted"] == 0 for one in certificates if one)
    transform = Compose([monai_transform(**options)])
    done = transform(samples[0])
    prediction = done["image"].clone()
    prediction.copy_((prediction > 100).to(prediction.dtype))
    done["pred"] = prediction
    back = Invertd("pred", transform, "image", nearest_interp=True)(done)["pred"]
    assert set(back.unique().tolist()) == {0, 1}
    expected = (sample["image"] > 100).float()
    assert (back[0] - expected[0]).abs().mean() < 0.01


@pytest.mark.parametrize("kind", ["bool", "int64", "float16", "bfloat16", "float64"])
def test_monai_keeps_types(kind):
    torch = pytest.importorskip("torch")
    sample = monai_sample()
    key = "label" if kind in ("bool", "int64") else "image"
    sample[key] = sample[key].to(getattr(torch, kind))
    transform = monai_transform()
    transform.set_random_state(1)
    done = transform(sample)
    assert done[key].dtype == sample[key].dtype and done[key].shape == sample[key].shape
    done["image"].affine[0, 3] = 99
    assert sample["image"].affine[0, 3] != 99
    with pytest.raises(TypeError, match="MetaTensor"):
        monai_transform(prob=0.0)({**sample, "image": sample["image"].as_tensor()})


class Samples:
    def __init__(self, samples, transform):
        self.samples, self.transform = samples, transform

    def __len__(self):
        return len(self.samples)

    def __getitem__(self, n):
        return self.transform(self.samples[n])


# --- TorchIO


def torchio_subject(**more) -> Any:
    torch = pytest.importorskip("torch")
    torchio = pytest.importorskip("torchio")
    image, labels = scene()
    affine = image.geometry.affine("RAS")

    def tensor(volume):
        return torch.as_tensor(volume.array).permute(2, 1, 0)[None].contiguous()

    return torchio.Subject(
        image=torchio.ScalarImage(tensor=tensor(image), affine=affine),
        label=torchio.LabelMap(tensor=tensor(labels), affine=affine),
        **more,
    )


def test_torchio_deforms_replays_and_pulls_back():
    subject = torchio_subject()
    import torch

    from tetwarp.torchio import CERTIFICATE, RandomTetwarp

    torch.manual_seed(4)
    transform = pickle.loads(pickle.dumps(RandomTetwarp(aug.ElasticAffine(), background=0)))
    done = transform(subject)
    image, labels = scene()
    expected = aug.Warp.of_record(json.loads(done[CERTIFICATE])).deform(image, labels=[labels], backgrounds=[0])
    assert np.array_equal(done["image"].data[0].numpy(), expected.images[0].array.transpose(2, 1, 0))
    assert np.array_equal(done["label"].data[0].numpy(), expected.labels[0].array.transpose(2, 1, 0))
    assert CERTIFICATE not in subject
    again = done.get_composed_history()(subject)
    assert torch.equal(again["image"].data, done["image"].data)
    back = done.apply_inverse_transform(warn=False)
    before, after = ((one["image"].data - subject["image"].data).abs().mean() for one in (done, back))
    assert after < 0.1 * before
    torch.manual_seed(4)
    assert torch.equal(transform(subject)["image"].data, done["image"].data)
    before = subject["image"].data.clone()
    assert torch.equal(done.history[0](subject)["image"].data, done["image"].data)
    assert torch.equal(subject["image"].data, before)


def test_torchio_makes_batches():
    torchio = pytest.importorskip("torchio")

    from tetwarp.torchio import CERTIFICATE, RandomTetwarp

    subjects = [torchio_subject() for _ in range(6)]
    data = torchio.SubjectsDataset(subjects, RandomTetwarp(aug.Elastic(80, 25, may_fold=True), p=0.5))
    certificates = [one for batch in torchio.SubjectsLoader(data, batch_size=3) for one in batch[CERTIFICATE]]
    assert len(certificates) == 6
    for one in filter(None, certificates):
        assert json.loads(one)["shrunk"] > 0 and "seed" in json.loads(one)
    assert CERTIFICATE not in subjects[0]


def test_torchio_takes_its_seed_from_the_subject():
    import importlib

    pytest.importorskip("torchio")
    RandomTetwarp = importlib.import_module("tetwarp.torchio").RandomTetwarp
    transform = RandomTetwarp(aug.Elastic(5, 40), seed=1, seed_key="name")
    one, two, three = (transform(torchio_subject(name=name))["image"].data for name in ("a", "b", "a"))
    assert (one == three).all() and not (one == two).all()
    with pytest.raises(tw.InputError, match="seed_key"):
        transform(torchio_subject())

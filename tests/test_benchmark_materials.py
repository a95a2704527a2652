"""Tests the benchmark of materials, without other programs."""

from example_files import load

benchmark = load("benchmarks/materials")


def test_a_bar_with_turned_fibres_stretches_as_its_compliance_says(monkeypatch):
    monkeypatch.setattr(benchmark.shutil, "which", lambda name: None)
    monkeypatch.setattr(benchmark, "by_felupe", lambda box: None)
    ((case, quantity, exact, ours, *others),) = benchmark.off_axis()
    assert (case, quantity, others) == ("bar, fibres at 30°", "u_x of the end", ["–", "–"])
    assert abs(float(ours) / float(exact) - 1.0) < 2e-4

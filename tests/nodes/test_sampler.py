"""Random graphs of nodes have the numbers of Cycles.

The first graphs of `sampler`, all in one picture; `python -m penumbra.tests.nodes.sampler` is the
long form, which finds what differs and cuts it down.
"""

COUNT = 49  # seven by seven


def render(folder):
    """Return how much of each graph differs."""
    from penumbra.tests.nodes import sampler

    theirs, ours = sampler.render([(seed, frozenset()) for seed in range(COUNT)], folder)
    shown = (abs(theirs - theirs[:, :1, :1]) > 0.01).any(axis=(1, 2, 3)).mean()
    return sampler.differ(theirs, ours), sampler.SHARE, shown


def test_random_graphs_have_the_numbers_of_cycles(blender, tmp_path):
    shares, most, shown = blender(render, tmp_path)
    assert shown > 0.1  # some graphs vary over their tile
    assert {seed for seed, share in enumerate(shares) if share > most} == set()

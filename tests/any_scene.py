"""Hypothesis strategies over everything that the table's ranges allow: evenly over the decades, the limits included."""

import math

from hypothesis import strategies as st

from drumstick.declare import Quantity, quantities
from drumstick.effects.pulse import Pulse
from drumstick.stick import Stick


def over(quantity: Quantity) -> st.SearchStrategy[float]:
    """Values of one quantity. Uniform numbers would never try a small one."""
    smallest = max(quantity.low, 1e-9)
    logarithmic = st.floats(math.log(smallest), math.log(quantity.high)).map(
        lambda x: min(max(math.exp(x), quantity.low), quantity.high)
    )
    limits = st.sampled_from([quantity.low, quantity.high])
    return logarithmic | logarithmic.map(lambda x: max(-x, quantity.low)) | limits


def tables(kind: type) -> st.SearchStrategy[object]:
    """Whole tables of one kind."""
    fields: dict[str, st.SearchStrategy[object]] = {}
    for key, quantity in quantities(kind).items():
        fields[key] = st.sampled_from(quantity.choices) if quantity.choices else over(quantity)
    return st.builds(kind, **fields)


STICKS, PULSES = tables(Stick), tables(Pulse)

"""A named tuple of arrays, passed on by its address: for a compiled loop whose functions all take it whole.

By value a tuple of 27 arrays is 200 words, pushed at each call, and each array taken out of it has its references
counted with atomic instructions: 5 us for a tick whose arithmetic takes 0.2 us. `borrowed_view` puts the tuple on the
stack of the function that calls it; what it returns is one pointer with the same attributes, whose arrays are
borrowed, so that nothing is counted. It may be passed down, never returned or kept.
"""

import hashlib
from typing import Any

from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import intrinsic, models, register_model

from realtime.kernels.handover import borrowed, is_plain


class BorrowedView(types.Type):
    """The type of a borrowed tuple. `types` and `fields` are the tuple's own: choices at compile time work on both."""

    def __init__(self, kind) -> None:
        self.kind = kind
        self.types = kind.types
        self.fields = kind.fields
        super().__init__(name=f"lent({kind.name})")

    @property
    def mangling_args(self):
        """The name in symbols: by content, and short."""
        return "lent", (hashlib.sha256(self.name.encode()).hexdigest()[:24],)


@register_model(BorrowedView)
class _BorrowedViewModel(models.OpaqueModel):
    """An address."""


def _pointer(context, builder, kind, address):
    return builder.bitcast(address, context.get_value_type(kind).as_pointer())


@infer_getattr
class _Attributes(AttributeTemplate):
    key = BorrowedView

    def generic_resolve(self, view, name):
        if name not in view.fields:
            return None
        member = view.types[view.fields.index(name)]
        return BorrowedView(member) if isinstance(member, types.NamedTuple) else member


@lower_getattr_generic(BorrowedView)
def _member(context, builder, view, address, name):
    at = view.fields.index(name)
    member = cgutils.gep_inbounds(builder, _pointer(context, builder, view.kind, address), 0, at)
    if isinstance(view.types[at], types.NamedTuple):  # a tuple within stays where it is
        return builder.bitcast(member, context.get_value_type(BorrowedView(view.types[at])))
    return borrowed(context, builder, view.types[at], builder.load(member))


@intrinsic
def _borrowed_view(typingctx, value):
    if isinstance(value, BorrowedView):
        return value(value), lambda context, builder, signature, args: args[0]
    if not (isinstance(value, types.NamedTuple) and is_plain(value)):
        return None

    def codegen(context, builder, signature, args):
        place = cgutils.alloca_once(builder, context.get_value_type(signature.args[0]))
        builder.store(args[0], place)
        return builder.bitcast(place, context.get_value_type(signature.return_type))

    return BorrowedView(value)(value), codegen


# borrowed_view(value): the named tuple by its address, good until the calling function returns. From compiled code
# only; the caller holds the tuple meanwhile. What is borrowed already stays as it is.
borrowed_view: Any = _borrowed_view

"""Scenes as they are written, those that are shipped, and what can be set live: by the declarations of all parts and
effects, which know nothing of this.
"""

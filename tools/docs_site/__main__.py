"""Command ``python -m tools.docs_site``: make everything that is committed for the site again.

Films, pictures of the examples, and the outputs of the notebook; some minutes.
"""

from __future__ import annotations

import sys

from . import example_pictures, films, notebook

if __name__ == "__main__":
    sys.exit(films.main([]) or example_pictures.main([]) or notebook.main())

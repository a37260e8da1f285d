"""Command ``python -m tools.docs_site``: make everything that is committed for the site again.

Films, pictures of the examples, the gallery's page, and the outputs of the notebook; some minutes.
"""

from __future__ import annotations

import sys

from . import example_pictures, films, gallery, notebook

if __name__ == "__main__":
    sys.exit(films.main([]) or example_pictures.main([]) or gallery.main() or notebook.main())

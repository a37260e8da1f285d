"""The documentation site: generated pages, films and pictures of the gallery, and the notebook.

``mkdocs.yml`` names ``hooks.py``, through which MkDocs gets the generated pages.
"""

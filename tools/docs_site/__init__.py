"""The documentation site: generated pages, films and pictures of the gallery, and the notebook.

``mkdocs.yml`` names ``hooks.py``, through which MkDocs gets the generated pages.
The pictures of the pages about safety, Nav2 and Gymnasium (``docs/images/reach.png``,
``nav2_costmap.png``, ``gymnasium.png``) are by page_pictures.py of commit 3030439d.
"""

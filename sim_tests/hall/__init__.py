"""The warehouse as data and meshes: layouts, racks, goods, props, textures, light."""

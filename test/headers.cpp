// What precompiled headers stand beside.

def late():
    import one

def decode(registry, options):
    return registry.get_choice_class(options["type"])(**{name: value for name, value in options.items() if name != "type"})

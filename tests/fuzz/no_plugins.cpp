namespace pileus {

class Registry;

/// Stands for the generated table of all plugins, which programs without scenes do without.
void register_builtin_plugins(Registry&);
void register_builtin_plugins(Registry&) {}

}  // namespace pileus

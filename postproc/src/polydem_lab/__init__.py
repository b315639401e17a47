"""The laboratory of polydem: benches of the finders, and what they say of the claims of Krengel et al. (2026).

Its verbs are those of `./polydem`: tables, cache, costs, workprecision, rivals, scale and paper. The package
polydem_post does not import it. Each of its packages imports only itself, polydem_post and those before it in `LAYERS`.
"""

#: The packages, lowest first
LAYERS = ("bench", "costs", "fine_grained", "tables", "claims", "report", "precision", "rivals",
          "scaling", "comparison", "command_line")

"""From a closed surface to a trivariate B-spline volume."""

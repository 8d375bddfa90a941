"""Writes tests/imitation/torch_reference.json: gradients that PyTorch's autograd gives in double precision.

    python tests/tools/torch_reference.py > tests/imitation/torch_reference.json

The tests recompute them with this project's own derivatives. Needs torch (measured with 2.13.0);
nothing else here does. All arrays are flat and column-major, parameters as in src/agail/nn/mlp.h:
W_l (out x in, column-major), then b_l, for each layer; then log_std.
"""

import json

import torch

torch.set_default_dtype(torch.float64)
torch.manual_seed(7)


def flat(x):
    return [
        float(f"{v:.17g}") for v in (x.detach().t().reshape(-1) if x.dim() == 2 else x.detach())
    ]


def mlp(theta, sizes, x):
    """x: inputs x n; also returns how many parameters it took."""
    at = 0
    h = x
    for layer, (i, o) in enumerate(zip(sizes[:-1], sizes[1:])):
        weight = theta[at : at + i * o].reshape(i, o).t()
        bias = theta[at + i * o : at + i * o + o]
        at += i * o + o
        h = weight @ h + bias[:, None]
        if layer + 2 < len(sizes):
            h = torch.tanh(h)
    return h, at


def distribution(theta, sizes, x, discrete):
    out, used = mlp(theta, sizes, x)
    if discrete:
        return torch.distributions.Categorical(logits=out.t())
    normal = torch.distributions.Normal(out.t(), theta[used:].exp())
    return torch.distributions.Independent(normal, 1)


def policy(discrete):
    sizes = [3, 4, 3, 2 if not discrete else 3]
    n, weight = 8, 0.3
    count = sum((i + 1) * o for i, o in zip(sizes[:-1], sizes[1:])) + (0 if discrete else 2)
    theta = (0.5 * torch.randn(count)).requires_grad_()
    x = torch.randn(3, n)
    actions = torch.randint(0, 3, (n,)).double() if discrete else torch.randn(n, 2)
    advantages, v = torch.randn(n), torch.randn(count)
    new = distribution(theta, sizes, x, discrete)
    old = distribution(theta.detach(), sizes, x, discrete)
    ratio = (new.log_prob(actions) - old.log_prob(actions)).exp()
    surrogate = (ratio * advantages).mean() + weight * new.entropy().mean()
    (gradient,) = torch.autograd.grad(surrogate, theta, retain_graph=True)
    kl = torch.distributions.kl_divergence(old, new).mean()
    (slope,) = torch.autograd.grad(kl, theta, create_graph=True)
    (product,) = torch.autograd.grad(slope @ v, theta)
    return {
        "discrete": discrete,
        "sizes": sizes,
        "entropy_weight": weight,
        "theta": flat(theta),
        "x": flat(x),
        "actions": flat(actions if discrete else actions.t()),
        "advantages": flat(advantages),
        "v": flat(v),
        "gradient": flat(gradient),
        "fisher_vector_product": flat(product),
    }


def discriminator():
    sizes, m, entropy_weight, penalty_weight = [3, 5, 4, 1], 6, 0.2, 0.7
    count = sum((i + 1) * o for i, o in zip(sizes[:-1], sizes[1:]))
    theta = (0.6 * torch.randn(count)).requires_grad_()
    x = torch.randn(3, 2 * m)
    between = torch.randn(3, m).requires_grad_()
    d = mlp(theta, sizes, x)[0][0]
    labels = torch.cat([torch.zeros(m), torch.ones(m)])
    loss = 2 * torch.nn.functional.binary_cross_entropy_with_logits(d, labels)
    loss = loss - entropy_weight * torch.distributions.Bernoulli(logits=d).entropy().mean()
    (slopes,) = torch.autograd.grad(mlp(theta, sizes, between)[0].sum(), between, create_graph=True)
    loss = loss + penalty_weight * ((slopes.norm(dim=0) - 1) ** 2).mean()
    (gradient,) = torch.autograd.grad(loss, theta)
    return {
        "sizes": sizes,
        "entropy_weight": entropy_weight,
        "gradient_penalty": penalty_weight,
        "theta": flat(theta),
        "x": flat(x),
        "between": flat(between),
        "loss": loss.item(),
        "gradient": flat(gradient),
    }


result = {"policies": [policy(False), policy(True)], "discriminator": discriminator()}
print(json.dumps(result, indent=None, separators=(",", ":")).replace('],"', '],\n"'))

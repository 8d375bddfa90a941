"""sb3-contrib's TRPO with the settings of agail's preset `paper` (and trpo.fisher_stride = 1: it uses every sample, too)."""

import gymnasium
import torch
from sb3_contrib import TRPO
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecEnv

BATCH = 1024
PACKAGES = ["gymnasium", "mujoco", "numpy", "torch", "stable-baselines3", "sb3-contrib"]


def environments(name: str, count: int, kind: str) -> VecEnv:
    makers = [lambda: gymnasium.make(name)] * count
    return SubprocVecEnv(makers) if kind == "subproc" else DummyVecEnv(makers)


def trpo(environment: VecEnv, **policy: object) -> TRPO:
    return TRPO(
        "MlpPolicy",
        environment,
        n_steps=BATCH // environment.num_envs,
        gamma=0.995,
        gae_lambda=0.97,
        target_kl=0.01,
        cg_max_steps=10,
        cg_damping=0.1,
        line_search_max_iter=10,
        batch_size=128,
        n_critic_updates=5,
        learning_rate=1e-3,
        device="cpu",
        policy_kwargs=dict(
            net_arch=dict(pi=[100, 100], vf=[100, 100]), activation_fn=torch.nn.Tanh, **policy
        ),
        seed=0,
    )

"""A task of one's own for kerf.gym: cut a strip of a wanted width off a plate.

    python strip_task.py            # plays the scripted expert, and checks the task with Gymnasium's checker

The plate hangs by two rims and sags, so the line to cut along is not straight in the world: the blade follows the material.
"""

import gymnasium
import kerf
import kerf.gym
import numpy as np
from gymnasium.utils.env_checker import check_env

SIDE = 1.0  # m: the model "sheet", its middle at the origin
REACH = 0.02  # m: farthest move of an action
BESIDE = 0.56  # m: the blade starts so far from the middle, beside the plate
HIGH, LOW = 0.4, -0.8  # m: ends of the blade's edge, above and below what sags


class Strip(kerf.gym.Tasks):
    """Cut a strip of a wanted width, 0.15 to 0.4 m, off a plate of 1 m x 1 m.

    Action (2): how far the upright blade goes along x and y, in parts of 2 cm. State (6): place of the blade (2), wanted width, the line
    at the blade's height as it is now, seen from the blade (1), pieces less one, and time (0 to 1). Lengths in metres, but the fourth in
    centimetres. Reward: -0.01 for each action, and at the end 1 less the relative error of the strip's mass. An episode ends when the
    plate is in two. info: width (m, by mass), is_success (within 5 % of what was wanted).
    """

    action_size, state_size = 2, 6
    steps, horizon = 2, 120
    camera = {"eye": (0, -1.3, 1.2), "target": (0, 0, -0.1)}

    def scene(self):
        rims = [{"half_space": {"point": [0.97 * x * SIDE / 2, 0, 0], "normal": [x, 0, 0]}} for x in (-1, 1)]
        return {"body": {"model": "sheet"}, "simulation": {"time_step": 0.02}, "fix": rims}

    def prepare(self):
        self.batch.turn(100)  # the plate comes to rest
        self.at = np.zeros((self.num_envs, 2))
        self.wanted, self.width, self.pieces = np.zeros(self.num_envs), np.zeros(self.num_envs), np.ones(self.num_envs)
        self.line = np.zeros(self.num_envs)

    def begin(self, row, random):
        self.wanted[row] = random.uniform(0.15, 0.4)
        self.width[row], self.pieces[row] = 0, 1
        self.at[row] = random.uniform(0.05, 0.4), -BESIDE
        self.batch.place_blade(row, *self.blade(row))

    def control(self, actions, plays):
        self.at[plays] += REACH * actions[plays]
        return {"blade": np.stack([self.blade(row) for row in range(self.num_envs)])}

    def look(self, states, rows):
        rest = np.stack([SIDE / 2 - self.wanted, np.clip(self.at[:, 1], -SIDE / 2, SIDE / 2), np.zeros(self.num_envs)], axis=1)
        self.line[rows] = self.batch.to_world(rest[:, None])[rows, 0, 0]
        self.pieces[rows] = self.batch.counts["pieces"][rows]
        state = [*self.at.T, self.wanted, 100 * (self.line - self.at[:, 0]), self.pieces - 1, self.elapsed / self.horizon_now]
        states[rows] = np.stack(state, axis=1)[rows]

    def judge(self, plays):
        done = plays & (self.pieces > 1)
        masses = self.batch.piece_masses(2)
        self.width[done] = SIDE * masses[done, 1] / masses[done].sum(axis=1)
        error = np.abs(self.width / self.wanted - 1)
        return np.where(done, 1 - error, 0) - 0.01, done

    def tell(self):
        return {"width": self.width, "is_success": np.abs(self.width / self.wanted - 1) < 0.05}

    def blade(self, row):
        return np.array([[*self.at[row], HIGH], [*self.at[row], LOW]])

    def expert(self):
        aside = (self.line - self.at[:, 0]) / REACH
        ahead = np.where(np.abs(aside) < 0.5, 1, 0)  # first beside the line's begin, then along it
        return np.clip(np.stack([aside, ahead], axis=1), -1, 1).astype(np.float32)

    def marked(self, row):  # dots in pictures
        along = np.linspace(-SIDE / 2, SIDE / 2, 60)
        return self.sessions[row].to_world(np.stack([np.full(60, SIDE / 2 - self.wanted[row]), along, np.zeros(60)], axis=1))


kerf.gym.register("Own/Strip-v0", Strip)


def main():
    check_env(gymnasium.make("Own/Strip-v0").unwrapped)
    envs = kerf.gym.make_vec("Own/Strip-v0", 4)
    envs.reset(seed=1)
    ended = np.zeros(4, bool)
    while not ended.all():
        _, _, terminated, truncated, info = envs.step(envs.expert())
        for row in np.flatnonzero((terminated | truncated) & ~ended):
            print(f"copy {row}: wanted {envs.wanted[row]:.3f} m, got {info['width'][row]:.3f} m")
        ended |= terminated | truncated
    envs.close()


if __name__ == "__main__":
    main()

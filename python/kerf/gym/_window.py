"""A window for render_mode "human"."""

from __future__ import annotations

from typing import Any


class Window:
    """Shows pictures, as many a second as told. Needs pygame."""

    def __init__(self, width: int, height: int, rate: int) -> None:
        try:
            import pygame
        except ImportError as error:
            raise ImportError('render_mode "human" needs pygame: pip install pygame') from error
        self._pygame = pygame
        pygame.display.init()
        self._screen = pygame.display.set_mode((width, height))
        pygame.display.set_caption("Kerf")
        self._clock, self._rate = pygame.time.Clock(), rate

    def show(self, picture: Any) -> None:
        """(height, width, 3), uint8."""
        self._pygame.event.pump()
        self._pygame.surfarray.blit_array(self._screen, picture.swapaxes(0, 1))
        self._pygame.display.flip()
        self._clock.tick(self._rate)

    def close(self) -> None:
        """Takes the window away."""
        self._pygame.display.quit()

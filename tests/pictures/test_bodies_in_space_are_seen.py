"""Pictures of bodies in space: the oblique camera sees every node, matplotlib looks along z."""

import mujoco
import numpy as np
import pytest
from spatial import lifted, space_body

import mcmj
from mcmj.mjcf.appearance import CAMERA_ANGLE, camera_of, node_colour
from mcmj.mjcf.read import load_model
from mcmj.pictures.film import Film
from mcmj.pictures.opengl import RenderingUnavailableError
from mcmj.pictures.plotting import draw_network, new_figure
from mcmj.pictures.rendering import HEIGHT, WIDTH, Style, body_view, film_frames
from mcmj.utils.colours import strain_colours


def rest(body):
    return body.positions, strain_colours(np.zeros(body.n_springs), 0.0), np.zeros(body.n_nodes)


@pytest.fixture(params=["mujoco", "matplotlib"])
def style(request):
    if request.param == "mujoco":
        try:
            with body_view(space_body(), Style(renderer="mujoco")):
                pass
        except RenderingUnavailableError as error:
            pytest.skip(f"no OpenGL here: {error}")
    return Style(renderer=request.param)


def seen_at(body):
    """Rows and columns of the nodes in the oblique camera's picture, by the pinhole's rule."""
    model = load_model(mcmj.to_mjcf(body))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = model.camera(camera_of(body)).id
    # right, up and backwards of the camera
    beside = (body.positions - data.cam_xpos[camera]) @ data.cam_xmat[camera].reshape(3, 3)
    pixels = HEIGHT / 2 / np.tan(np.radians(CAMERA_ANGLE / 2)) / -beside[:, 2]
    return HEIGHT / 2 - pixels * beside[:, 1], WIDTH / 2 + pixels * beside[:, 0]


@pytest.mark.parametrize("depth", [0.01, 1.0, 30.0])
def test_the_oblique_camera_sees_all(depth):
    body = mcmj.random_body(0, 30, width=1.0, height=1.0, depth=depth)
    rows, columns = seen_at(body)
    assert rows.min() > 10
    assert rows.max() < HEIGHT - 10
    assert columns.min() > 10
    assert columns.max() < WIDTH - 10
    assert max(np.ptp(rows) / HEIGHT, np.ptp(columns) / WIDTH) > 0.3


def test_nodes_have_their_colours_where_they_are_seen():
    body = mcmj.random_body(0, 5, width=1.0, height=1.0, depth=1.0)
    try:
        with body_view(body, Style(renderer="mujoco")) as view:
            picture = view.draw(*rest(body))
    except RenderingUnavailableError as error:
        pytest.skip(f"no OpenGL here: {error}")
    right = 0
    for node, (row, column) in enumerate(zip(*seen_at(body), strict=True)):
        pixel = picture[round(row), round(column)].astype(float)
        right += bool((np.abs(pixel - 255 * np.array(node_colour(body, node))) < 60).all())
    assert right >= body.n_nodes - 1  # one may hide another


def test_matplotlib_shows_the_body_as_seen_along_z():
    body = mcmj.random_body(0, 8, width=1.0, height=1.0)
    flat = Style(renderer="matplotlib")
    arrows = np.where(body.fixed, 0.0, 0.2)
    with body_view(body, flat) as one, body_view(lifted(body), flat) as other:
        pictures = [
            view.draw(*rest(b)[:2], arrows) for view, b in ((one, body), (other, lifted(body)))
        ]
    assert np.array_equal(*pictures)


def test_a_film_in_space(style):
    body = space_body()
    forces = np.where(body.fixed, 0.0, 5.0)
    run = mcmj.Simulation(body).rollout(200, forces=forces, record=("positions", "outputs"))
    film = Film(body, run.times, run.positions, run.outputs, forces=np.tile(forces, (200, 1)))
    frames = list(film_frames(film, style))
    assert len(frames) == 5
    assert not np.array_equal(frames[0][:, :WIDTH], frames[-1][:, :WIDTH])


def test_plot_of_the_body_has_its_axes_named():
    axes = new_figure(4, 4).add_subplot()
    draw_network(axes, space_body())
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [m]", "y [m]")

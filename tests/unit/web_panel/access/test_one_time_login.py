from web_panel.access.one_time_login import LIFE_S, OneTimeLogin


class Clock:
    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def test_a_link_admits_once() -> None:
    login = OneTimeLogin(Clock())
    secret = login.renew()
    assert login.open_secret == secret
    assert not login.take(secret + "x")
    assert login.take(secret)
    assert not login.take(secret)
    assert (login.open_secret, login.left_s) == ("", 0.0)


def test_a_link_ends_by_itself() -> None:
    clock = Clock()
    login = OneTimeLogin(clock)
    secret = login.renew()
    clock.now_s += LIFE_S
    assert not login.take(secret)
    assert (login.open_secret, login.left_s) == ("", 0.0)


def test_a_new_link_ends_the_one_before() -> None:
    login = OneTimeLogin(Clock())
    before, now = login.renew(), login.renew()
    assert before != now
    assert not login.take(before)
    assert login.take(now)


def test_nothing_admits_before_there_is_a_link() -> None:
    login = OneTimeLogin(Clock())
    assert not login.take("")

! An impact oscillator as a two-segment boundary-value problem for AUTO-07p.
!
!   x'' + c x' + k x = A cos(theta),  theta' = w,  wall x <= d,  v+ = -e v-
!
! Two flights in a row, i = 1, 2, over two forcing periods together, with the time
! of each scaled to 1:
!
!   x_i' = T_i v_i,  v_i' = T_i (A cos(theta_i) - c v_i - k x_i),  theta_i' = T_i w     (6 equations)
!   x_i(0) = d, x_i(1) = d                                                             (4 conditions)
!   v_2(0) = -e v_1(1),  v_1(0) = -e v_2(1)                                            (2)
!   theta_2(0) = theta_1(1),  theta_2(1) = theta_1(0) + 4 pi                           (2)
!
! Eight conditions on six functions: one parameter and the times T_1, T_2 are free. An orbit of one
! impact per period is a solution with equal flights; where it doubles its period AUTO finds a
! branch point.
!
! Unknowns U: x_1, v_1, theta_1, x_2, v_2, theta_2.
! Parameters PAR: 1 k, 2 c, 3 A, 4 w, 5 d, 6 e, 7 T_1, 8 T_2; measured: 9, 10 the impact speeds
! v_1(1), v_2(1); 12, 13 the phases theta_1(1), theta_2(1) of the impacts.

subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
  implicit none
  integer, intent(in) :: ndim, icp(*), ijac
  double precision, intent(in) :: u(ndim), par(*)
  double precision, intent(out) :: f(ndim)
  double precision, intent(inout) :: dfdu(ndim, ndim), dfdp(ndim, *)
  integer :: i
  do i = 0, 1
    f(3*i + 1) = par(7 + i) * u(3*i + 2)
    f(3*i + 2) = par(7 + i) * (par(3) * cos(u(3*i + 3)) - par(2) * u(3*i + 2) - par(1) * u(3*i + 1))
    f(3*i + 3) = par(7 + i) * par(4)
  end do
end subroutine func

subroutine bcnd(ndim, par, icp, nbc, u0, u1, fb, ijac, dbc)
  implicit none
  integer, intent(in) :: ndim, icp(*), nbc, ijac
  double precision, intent(in) :: par(*), u0(ndim), u1(ndim)
  double precision, intent(out) :: fb(nbc)
  double precision, intent(inout) :: dbc(nbc, *)
  double precision, parameter :: pi = 3.14159265358979323846d0
  fb(1) = u0(1) - par(5)
  fb(2) = u1(1) - par(5)
  fb(3) = u0(4) - par(5)
  fb(4) = u1(4) - par(5)
  fb(5) = u0(5) + par(6) * u1(2)
  fb(6) = u0(2) + par(6) * u1(5)
  fb(7) = u0(6) - u1(3)
  fb(8) = u1(6) - u0(3) - 4 * pi
end subroutine bcnd

subroutine stpnt(ndim, u, par, t)  ! the start is read from a file written by run.py
  implicit none
  integer, intent(in) :: ndim
  double precision, intent(inout) :: u(ndim), par(*)
  double precision, intent(in) :: t
end subroutine stpnt

subroutine pvls(ndim, u, par)
  implicit none
  integer, intent(in) :: ndim
  double precision, intent(in) :: u(ndim)
  double precision, intent(inout) :: par(*)
  double precision, external :: getp
  par(9) = getp('BV1', 2, u)
  par(10) = getp('BV1', 5, u)
  par(12) = getp('BV1', 3, u)
  par(13) = getp('BV1', 6, u)
end subroutine pvls

subroutine icnd
end subroutine icnd

subroutine fopt
end subroutine fopt

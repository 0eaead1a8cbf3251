! The generalised Henon map (x, y) -> (y, alpha - beta x - y^2 + R x y), for AUTO-07p (README.md).
      subroutine FUNC(NDIM, U, ICP, PAR, IJAC, F, DFDU, DFDP)
      implicit none
      integer, intent(in) :: NDIM, ICP(*), IJAC
      double precision, intent(in) :: U(NDIM), PAR(*)
      double precision, intent(out) :: F(NDIM)
      double precision, intent(inout) :: DFDU(NDIM, NDIM), DFDP(NDIM, *)
      F(1) = U(2)
      F(2) = PAR(1) - PAR(2)*U(1) - U(2)**2 + PAR(3)*U(1)*U(2)
      if (IJAC == 0) return
      DFDU(1, 1:2) = (/ 0.0d0, 1.0d0 /)
      DFDU(2, 1:2) = (/ -PAR(2) + PAR(3)*U(2), -2.0d0*U(2) + PAR(3)*U(1) /)
      if (IJAC == 1) return
      DFDP(1, 1:3) = 0.0d0
      DFDP(2, 1:3) = (/ 1.0d0, -U(1), U(1)*U(2) /)
      end subroutine FUNC

      subroutine STPNT(NDIM, U, PAR, T)
      implicit none
      integer, intent(in) :: NDIM
      double precision, intent(inout) :: U(NDIM), PAR(*)
      double precision, intent(in) :: T
      PAR(1:3) = (/ 0.0d0, 0.5d0, 0.5d0 /) ! alpha, beta, R
      U = 0.0d0                            ! a fixed point at alpha = 0
      end subroutine STPNT

      subroutine BCND
      end subroutine BCND
      subroutine ICND
      end subroutine ICND
      subroutine FOPT
      end subroutine FOPT
      subroutine PVLS
      end subroutine PVLS
